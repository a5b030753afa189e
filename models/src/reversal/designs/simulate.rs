//! Readings of a design with known truth. Nothing here is shared with the fit: waves in place of
//! splines, angles as they are, and the point of contact by bisection.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use thiserror::Error;

use super::channel::Design;
pub use super::disturbance::{
    DESIGN_EFFECTS, DesignEffect, DesignEffectKind, DesignFrame, DesignPlace,
};
use super::disturbance::{Moment, Standing};
use super::readings::{DesignObservations, DesignReading};
use crate::reversal::Direction;

/// What to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignPlan {
    /// The channels.
    pub design: Design,
    /// α_h, α_v, γ_1, γ_2, τ, κ_c, κ_s, rad.
    pub slopes_rad: [f64; 7],
    /// Eccentricity e_1, e_2 and oval part o, µm, with zeros that are kept; `None`: zeros set anew for
    /// each trace.
    pub kept_um: Option<[f64; 3]>,
    /// Diameter of the artefact, mm.
    pub thickness_mm: f64,
    /// Travel from 0, mm.
    pub length_mm: f64,
    /// Positions of each trace, evenly spread.
    pub positions: usize,
    /// How often each trace is taken.
    pub repeats: u32,
    /// Standard deviation of a reading, µm.
    pub noise_um: f64,
    /// Root mean square of the slide's forms and of the sides', µm.
    pub forms_um: [f64; 2],
    /// Whether each repeat is taken forward and backward.
    pub both_directions: bool,
    /// Whether the spindle is turned in every repeat; otherwise a position has all its repeats first.
    pub turned_each_repeat: bool,
    /// Seconds from one reading to the next; all indicators are read at once.
    pub interval_s: f64,
    /// Effects that the fit leaves out.
    pub effects: Vec<DesignEffect>,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl DesignPlan {
    /// Traces of 61 positions over 300 mm, once and forward, without thickness, slopes, noise and forms.
    pub fn of(design: Design) -> Self {
        Self {
            design,
            slopes_rad: [0.0; 7],
            kept_um: None,
            thickness_mm: 0.0,
            length_mm: 300.0,
            positions: 61,
            repeats: 1,
            noise_um: 0.0,
            forms_um: [0.0; 2],
            both_directions: false,
            turned_each_repeat: false,
            interval_s: 0.5,
            effects: Vec::new(),
            seed: 0,
        }
    }
}

/// Why nothing can be simulated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DesignPlanError {
    /// A number that makes no sense.
    #[error("{what} = {value}: it must be {must}")]
    NotUsable {
        /// What it is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
}

/// A form as a sum of waves less a straight line.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveForm {
    /// Amplitude (µm), wave number (rad/mm), phase (rad).
    waves: Vec<[f64; 3]>,
    /// Height (µm) at 0 and slope (µm/mm) of the line taken out.
    line: [f64; 2],
}

/// What is true of simulated readings.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignTruth {
    /// α_h, α_v, γ_1, γ_2, τ, κ_c, κ_s, rad.
    pub slopes_rad: [f64; 7],
    /// M_h and M_v.
    pub slide: [WaveForm; 2],
    /// The forms of the sides, in the order of the design.
    pub sides: Vec<WaveForm>,
}

/// Waves in a form.
const WAVES: u32 = 4;

impl WaveForm {
    /// Random waves no shorter than two fifths of the length, without straight-line part over the
    /// positions.
    fn random(rng: &mut ChaCha8Rng, rms: f64, length: f64, x: &[f64]) -> Self {
        let share = rms * (2.0 / f64::from(WAVES)).sqrt();
        let waves = (0..WAVES)
            .map(|k| {
                let turns = 0.9 + 0.5 * f64::from(k) + 0.1 * rng.random::<f64>();
                [share, TAU * turns / length, TAU * rng.random::<f64>()]
            })
            .collect();
        let mut form = Self {
            waves,
            line: [0.0; 2],
        };
        let n = x.len() as f64;
        let y: Vec<f64> = x.iter().map(|x| form.at(*x)).collect();
        let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
        let product: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
        let slope = product / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>();
        form.line = [my - slope * mx, slope];
        form
    }

    /// Its value, µm, at a position, mm.
    pub fn at(&self, x: f64) -> f64 {
        let waves = self
            .waves
            .iter()
            .map(|[a, k, phase]| a * (k * x + phase).sin());
        waves.sum::<f64>() - self.line[0] - self.line[1] * x
    }
}

impl DesignPlan {
    /// The positions of each trace, mm.
    pub fn x(&self) -> Vec<f64> {
        let step = self.length_mm / (self.positions.max(2) - 1) as f64;
        (0..self.positions).map(|k| k as f64 * step).collect()
    }

    fn check(&self) -> Result<(), DesignPlanError> {
        let at_least =
            |what, value: f64, least: f64, must| match value.is_finite() && value >= least {
                true => Ok(()),
                false => Err(DesignPlanError::NotUsable { what, value, must }),
            };
        at_least("positions", self.positions as f64, 3.0, "3 or more")?;
        at_least("repeats", f64::from(self.repeats), 1.0, "1 or more")?;
        at_least("length", self.length_mm, f64::MIN_POSITIVE, "above 0 mm")?;
        at_least("thickness", self.thickness_mm, 0.0, "0 mm or more")?;
        at_least("noise", self.noise_um, 0.0, "0 um or more")?;
        at_least("interval", self.interval_s, f64::MIN_POSITIVE, "above 0 s")?;
        for effect in &self.effects {
            let finite = if effect.size.is_finite() { 0.0 } else { -1.0 };
            at_least("the size of an effect", finite, 0.0, "finite")?;
        }
        for rms in self.forms_um {
            at_least("forms", rms, 0.0, "0 um or more")?;
        }
        let total: f64 = self.slopes_rad.iter().map(|s| s.abs()).sum();
        match total < 0.5 {
            true => Ok(()),
            false => Err(DesignPlanError::NotUsable {
                what: "sum of slopes in rad",
                value: total,
                must: "below 0.5",
            }),
        }
    }
}

/// Readings of a plan, and what is true of them.
///
/// # Errors
/// [`DesignPlanError`]: a number of the plan that makes no sense.
pub fn simulate(plan: &DesignPlan) -> Result<(DesignObservations, DesignTruth), DesignPlanError> {
    plan.check()?;
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    let rig = Rig::new(plan, &mut rng);
    let frame = match plan.effects.is_empty() {
        true => None,
        false => Some(rig.frame()),
    };
    let mut readings = Vec::new();
    for trace in rig.traces() {
        let shown = rig.shown(&trace, frame.as_ref());
        for (m, value) in trace.iter().zip(shown) {
            let noise: f64 = StandardNormal.sample(&mut rng);
            readings.push(DesignReading {
                channel: m.channel,
                repeat: m.repeat,
                direction: match m.way > 0.0 {
                    true => Direction::Forward,
                    false => Direction::Backward,
                },
                time: Some(m.time),
                x: m.x,
                value: value + plan.noise_um * noise,
            });
        }
    }
    let design = plan.design.clone();
    Ok((DesignObservations { design, readings }, rig.truth))
}

/// What effects are drawn from: the plan carried out without noise and effects.
///
/// # Errors
/// As [`simulate`].
pub fn frame(plan: &DesignPlan) -> Result<DesignFrame, DesignPlanError> {
    plan.check()?;
    Ok(Rig::new(plan, &mut ChaCha8Rng::seed_from_u64(plan.seed)).frame())
}

/// The machine of a plan.
struct Rig<'a> {
    plan: &'a DesignPlan,
    truth: DesignTruth,
    /// What each channel reads where nothing deviates, µm.
    zeros: Vec<f64>,
    x: Vec<f64>,
}

impl<'a> Rig<'a> {
    fn new(plan: &'a DesignPlan, rng: &mut ChaCha8Rng) -> Self {
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
    fn traces(&self) -> Vec<Vec<Moment>> {
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
        value + self.zeros[m.channel]
    }

    /// What is shown along a trace, in the order in which it is read, µm.
    fn shown(&self, trace: &[Moment], frame: Option<&DesignFrame>) -> Vec<f64> {
        let mut shown: Vec<f64> = trace.iter().map(|m| self.seen(m, frame)).collect();
        let Some(frame) = frame else {
            return shown;
        };
        for (m, value) in trace.iter().zip(&mut shown) {
            let seen = *value;
            let effects = self.plan.effects.iter();
            *value += effects
                .map(|e| e.of_the_indicator(frame, m, seen))
                .sum::<f64>();
        }
        let width = |e: &DesignEffect| trace.first().and_then(|m| e.play(m));
        for half in self.plan.effects.iter().filter_map(width).map(|w| 0.5 * w) {
            follow(&mut shown, half);
        }
        shown
    }

    fn frame(&self) -> DesignFrame {
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
