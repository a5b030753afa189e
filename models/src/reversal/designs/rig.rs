//! The machine of a plan: what its indicators show.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::disturbance::{DesignEffect, DesignFrame, Moment, Standing};
use super::options::Crest;
use super::simulate::{DesignPlan, DesignTruth};
use super::wave_form::WaveForm;

/// The machine of a plan.
pub(super) struct Rig<'a> {
    plan: &'a DesignPlan,
    pub truth: DesignTruth,
    /// What each channel reads where nothing deviates, µm.
    zeros: Vec<f64>,
    x: Vec<f64>,
}

impl<'a> Rig<'a> {
    pub fn new(plan: &'a DesignPlan, rng: &mut ChaCha8Rng) -> Self {
        let x = plan.x();
        let [of_slide, of_side] = plan.forms_um;
        let mut form = |rms| WaveForm::random(rng, rms, plan.length_mm, &x);
        let truth = DesignTruth {
            slopes_rad: plan.slopes_rad,
            slide: [form(of_slide), form(of_slide)],
            sides: plan.design.sides().iter().map(|_| form(of_side)).collect(),
        };
        let channels = plan.design.channels();
        let drawn: Vec<f64> = channels
            .iter()
            .map(|_| 40.0 * rng.random::<f64>())
            .collect();
        let zeros = channels.iter().enumerate().map(|(c, channel)| {
            let psi = (channel.indicator - channel.spindle).to_radians();
            match plan.kept_um {
                None => drawn[c],
                Some([e_1, e_2, o]) => {
                    let own = place_of(&plan.design.indicators(), channel.indicator);
                    drawn[own] + e_1 * psi.cos() + e_2 * psi.sin() + o * (2.0 * psi).cos()
                }
            }
        });
        Self {
            zeros: zeros.collect(),
            plan,
            truth,
            x,
        }
    }

    /// The moments of every trace, by channel, repeat and direction: all indicators are read at once, the
    /// spindle is turned when a position has all its repeats, or in every repeat.
    pub fn traces(&self) -> Vec<Vec<Moment>> {
        let (plan, design) = (self.plan, &self.plan.design);
        let (indicators, positions) = (design.indicators(), design.positions());
        let ways: &[f64] = match plan.both_directions {
            true => &[1.0, -1.0],
            false => &[1.0],
        };
        let (repeats, spindles, n) = (plan.repeats as usize, positions.len(), self.x.len());
        let mut traces = Vec::new();
        for (c, channel) in design.channels().iter().enumerate() {
            let position = place_of(&positions, channel.spindle);
            for repeat in 0..repeats {
                let pass = match plan.turned_each_repeat {
                    true => repeat * spindles + position,
                    false => position * repeats + repeat,
                };
                for (half, way) in ways.iter().enumerate() {
                    let first = (pass * ways.len() + half) * n;
                    let moment = |k: usize| Moment {
                        channel: c,
                        indicator: place_of(&indicators, channel.indicator),
                        position,
                        phi: channel.indicator.to_radians(),
                        psi: (channel.indicator - channel.spindle).to_radians(),
                        repeat: repeat as u32 + 1,
                        way: *way,
                        x: self.x[if *way > 0.0 { k } else { n - 1 - k }],
                        time: plan.interval_s * (first + k) as f64,
                    };
                    traces.push((0..n).map(moment).collect());
                }
            }
        }
        traces
    }

    /// The tilt of a channel that sees the side at ψ, rad.
    fn tilt(&self, phi: f64, psi: f64) -> f64 {
        let [alpha_h, alpha_v, gamma_1, gamma_2, cone, kappa_c, kappa_s] = self.plan.slopes_rad;
        alpha_h * phi.cos()
            + alpha_v * phi.sin()
            + gamma_1 * psi.cos()
            + gamma_2 * psi.sin()
            + cone
            + kappa_c * (2.0 * psi).cos()
            + kappa_s * (2.0 * psi).sin()
    }

    /// What an indicator's scale stands at, µm, with the effects that act before it where there is a frame.
    fn seen(&self, m: &Moment, frame: Option<&DesignFrame>) -> f64 {
        let mut standing = Standing {
            slide: m.x,
            psi: m.psi,
            tilt: 0.0,
            shift: 0.0,
            thickness: self.plan.thickness_mm,
        };
        let effects = || {
            frame
                .into_iter()
                .flat_map(|f| self.plan.effects.iter().map(move |e| (f, e)))
        };
        for (frame, effect) in effects() {
            effect.before(frame, m, &mut standing);
        }
        let at = standing.slide;
        let side = &self.truth.sides[self.plan.design.side_of(m.channel)];
        let tilt = standing.tilt + self.tilt(m.phi, standing.psi);
        let seen = touched(at, tilt, standing.thickness / 2.0, |u| {
            side.at(u - standing.shift)
        });
        let [horizontal, vertical] = [0, 1].map(|k| self.truth.slide[k].at(at));
        let mut value = 1e3 * seen + horizontal * m.phi.cos() + vertical * m.phi.sin();
        let place = at - standing.shift;
        let slope = (side.at(place + 0.01) - side.at(place - 0.01)) / 0.02;
        let [alpha_h, alpha_v, gamma_1, gamma_2, ..] = self.plan.slopes_rad;
        let askew = -alpha_h * m.phi.sin() + alpha_v * m.phi.cos() - gamma_1 * standing.psi.sin()
            + gamma_2 * standing.psi.cos();
        let wandered = 1e-3 * (vertical * m.phi.cos() - horizontal * m.phi.sin());
        let across = askew * (at - 0.5 * self.plan.length_mm) + wandered;
        for (frame, effect) in effects() {
            value += effect.at_the_stylus(frame, m, slope, across);
        }
        if let Some(crest) = &self.plan.crest {
            let bar = self.bar_at(m, at, [horizontal, vertical]);
            value -= 1e3 * self.lost(crest, m, bar);
        }
        value + self.zeros[m.channel]
    }

    /// Where the axis of the bar stands at a slide position, mm, horizontally and vertically, from where it
    /// stands at mid travel without forms and, with zeros that are kept, without eccentricity.
    fn bar_at(&self, m: &Moment, at: f64, slide_um: [f64; 2]) -> [f64; 2] {
        let [alpha_h, alpha_v, gamma_1, gamma_2, ..] = self.plan.slopes_rad;
        let middle = 0.5 * self.plan.length_mm;
        let own = match self.plan.kept_um {
            None => [gamma_1 * (at - middle), gamma_2 * (at - middle)],
            Some([e_1, e_2, _]) => [1e-3 * e_1 + gamma_1 * at, 1e-3 * e_2 + gamma_2 * at],
        };
        // The spindle turns side 0 towards the top.
        let (sin, cos) = (m.phi - m.psi).sin_cos();
        [
            alpha_h * (at - middle) + 1e-3 * slide_um[0] + cos * own[0] - sin * own[1],
            alpha_v * (at - middle) + 1e-3 * slide_um[1] + sin * own[0] + cos * own[1],
        ]
    }

    /// How much lower a stylus stands than on the crest, mm: its centre and that of the bar are the sum of
    /// their radii apart.
    fn lost(&self, crest: &Crest, m: &Moment, bar: [f64; 2]) -> f64 {
        let radii = 0.5 * self.plan.thickness_mm + crest.tip_mm;
        let beside = crest.offset_mm[m.channel] - bar[0] * m.phi.sin() + bar[1] * m.phi.cos();
        radii * (1.0 - (beside / radii).asin().cos())
    }

    /// What is shown along a trace, in the order in which it is read, µm.
    pub fn shown(&self, trace: &[Moment], frame: Option<&DesignFrame>) -> Vec<f64> {
        let mut shown: Vec<f64> = trace.iter().map(|m| self.seen(m, frame)).collect();
        let Some(frame) = frame else {
            return shown;
        };
        for (m, value) in trace.iter().zip(&mut shown) {
            let effects = self.plan.effects.iter();
            *value += effects.map(|e| e.of_the_mount(frame, m)).sum::<f64>();
        }
        let width = |e: &DesignEffect| trace.first().and_then(|m| e.play(m));
        for half in self.plan.effects.iter().filter_map(width).map(|w| 0.5 * w) {
            follow(&mut shown, half);
        }
        for (m, value) in trace.iter().zip(&mut shown) {
            let stands = *value;
            let effects = self.plan.effects.iter();
            *value += effects
                .map(|e| e.of_the_scale(frame, m, stands))
                .sum::<f64>();
        }
        shown
    }

    pub fn frame(&self) -> DesignFrame {
        let plan = self.plan;
        let channels = plan.design.channels().len();
        let empty = (f64::INFINITY, f64::NEG_INFINITY);
        let wider = |range: &mut (f64, f64), value: f64| {
            range.0 = range.0.min(value);
            range.1 = range.1.max(value);
        };
        let (mut values, mut times) = (vec![empty; channels], vec![empty; channels]);
        let mut middle = vec![0.0; channels];
        for trace in self.traces() {
            for m in &trace {
                wider(&mut values[m.channel], self.seen(m, None));
                wider(&mut times[m.channel], m.time);
            }
            if let Some(m) = trace.first() {
                let mid = Moment {
                    x: 0.5 * plan.length_mm,
                    ..*m
                };
                middle[m.channel] = self.seen(&mid, None);
            }
        }
        let spans = values.iter().map(|(low, high)| high - low);
        let reaches = values.iter().map(|(low, high)| high.abs().max(low.abs()));
        DesignFrame {
            length_mm: plan.length_mm,
            thickness_mm: plan.thickness_mm,
            span_um: spans.fold(f64::MIN_POSITIVE, f64::max),
            reach_um: reaches.fold(f64::MIN_POSITIVE, f64::max),
            duration_s: times.iter().fold(f64::MIN_POSITIVE, |d, t| d.max(t.1)),
            times_s: times,
            middle_um: middle,
            repeats: plan.repeats,
        }
    }
}

/// The place of the nearest of some angles, degrees.
fn place_of(angles: &[f64], angle: f64) -> usize {
    let apart = |a: &f64| ((a - angle + 180.0).rem_euclid(360.0) - 180.0).abs();
    (0..angles.len())
        .min_by(|a, b| apart(&angles[*a]).total_cmp(&apart(&angles[*b])))
        .unwrap_or(0)
}

/// The pointer of an indicator follows its stylus once this has moved by half the play. Before the first
/// reading the stylus came the way that it goes on.
fn follow(shown: &mut [f64], half: f64) {
    let goes_on = match (shown.first(), shown.last()) {
        (Some(first), Some(last)) => (last - first).signum(),
        _ => return,
    };
    let mut pointer = shown[0] - half * goes_on;
    for value in shown {
        pointer = pointer.clamp(*value - half, *value + half);
        *value = pointer;
    }
}

/// What an indicator at slide position x reads, mm, of a bar of half thickness h whose surface, h and its
/// form (µm) above an axis, is turned by the tilt about the origin: the height of the surface above h
/// where it crosses the line of the indicator.
fn touched(x: f64, tilt: f64, h: f64, form_um: impl Fn(f64) -> f64) -> f64 {
    let (sin, cos) = tilt.sin_cos();
    let height = |u: f64| h + form_um(u) / 1e3;
    let along = |u: f64| u * cos - height(u) * sin;
    let reach = 1.0 + (x.abs() + h) * (tilt.abs() + tilt * tilt);
    let (mut low, mut high) = (x - reach, x + reach);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if along(middle) < x {
            low = middle;
        } else {
            high = middle;
        }
    }
    let u = 0.5 * (low + high);
    u * sin + height(u) * cos - h
}
