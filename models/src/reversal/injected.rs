//! Any effect of the catalogue put into a simulated reversal, in its exact form.

use std::cell::RefCell;
use std::collections::BTreeMap;

use super::injection::{Frame, Injection, Zero};
use super::simulate::{Disturbance, GaugedForm, Plan, PlanError, Situation, simulate};
use super::{Channel, Direction};

/// An effect in its place: what its exact form needs to know of the plan.
pub struct Injected {
    effect: Injection,
    zero: Zero,
    travel: (f64, f64),
    sides: [GaugedForm; 2],
    /// Where the indicator's pointer stands, by channel, repeat and direction.
    pointer: RefCell<BTreeMap<(Channel, u32, bool), f64>>,
}

/// What a plan gives without noise and effects.
#[derive(Debug, Clone)]
pub struct Undisturbed {
    zero: Zero,
    /// What the secondary parameters of an effect are drawn from.
    pub frame: Frame,
    sides: [GaugedForm; 2],
}

impl Undisturbed {
    /// Carries out a plan without noise and effects.
    ///
    /// # Errors
    /// [`PlanError`] where a number of the plan cannot be used.
    pub fn of(plan: &Plan) -> Result<Self, PlanError> {
        let mut quiet = plan.clone();
        quiet.outlier_share = 0.0;
        for trace in &mut quiet.traces {
            trace.noise = 0.0;
        }
        let (observations, truth) = simulate(&quiet, &[])?;
        let mut ends = [(f64::INFINITY, f64::NEG_INFINITY); 4];
        let mut times = [(f64::INFINITY, f64::NEG_INFINITY); 4];
        let mut travel = (f64::INFINITY, f64::NEG_INFINITY);
        let wider = |range: &mut (f64, f64), value: f64| {
            range.0 = range.0.min(value);
            range.1 = range.1.max(value);
        };
        for reading in &observations.readings {
            wider(&mut travel, reading.x);
            wider(
                &mut times[reading.channel.index()],
                reading.time.unwrap_or(0.0),
            );
        }
        let centre = 0.5 * (travel.0 + travel.1);
        let middle = Channel::ALL.map(|channel| {
            observations
                .of(channel)
                .min_by(|a, b| (a.x - centre).abs().total_cmp(&(b.x - centre).abs()))
                .map_or(0.0, |r| r.value)
        });
        for reading in &observations.readings {
            let k = reading.channel.index();
            wider(&mut ends[k], reading.value - middle[k]);
        }
        let low = ends.iter().map(|e| e.0).fold(f64::INFINITY, f64::min);
        let high = ends.iter().map(|e| e.1).fold(f64::NEG_INFINITY, f64::max);
        let duration = times.iter().map(|t| t.1).fold(0.0, f64::max);
        let reach = observations
            .readings
            .iter()
            .map(|r| r.value.abs())
            .fold(f64::MIN_POSITIVE, f64::max);
        Ok(Self {
            zero: Zero {
                middle,
                reach,
                duration,
            },
            frame: Frame {
                travel,
                span: (high - low).max(f64::MIN_POSITIVE),
                duration,
                times,
                repeats: plan.repeats,
            },
            sides: [truth.s_a, truth.s_b],
        })
    }
}

impl Injected {
    /// An effect in an undisturbed plan.
    pub fn new(effect: Injection, undisturbed: &Undisturbed) -> Self {
        Self {
            effect,
            zero: undisturbed.zero,
            travel: undisturbed.frame.travel,
            sides: undisturbed.sides.clone(),
            pointer: RefCell::default(),
        }
    }

    fn play(&self, situation: &Situation, shown: f64, width: f64) -> f64 {
        let key = (
            situation.channel,
            situation.repeat,
            situation.direction == Direction::Backward,
        );
        let half = 0.5 * width;
        let mut pointers = self.pointer.borrow_mut();
        // The slide comes from before the first position: the play is taken up the way in which
        // the tilt drives the reading.
        let drive = situation.tilt_rad * direction_sign(situation);
        let last = pointers
            .get(&key)
            .copied()
            .unwrap_or(shown - half * drive.signum());
        let next = last.clamp(shown - half, shown + half);
        pointers.insert(key, next);
        next
    }
}

fn direction_sign(situation: &Situation) -> f64 {
    match situation.direction {
        Direction::Forward => 1.0,
        Direction::Backward => -1.0,
    }
}

impl Disturbance for Injected {
    fn before(&self, situation: &mut Situation) {
        match self.effect {
            Injection::Taper(cone) => situation.tilt_rad += cone,
            Injection::AxisBacklash(lost) => {
                situation.slide -= 0.5 * direction_sign(situation) * lost;
            }
            Injection::ReversalShift(shift) if situation.channel.spindle_sign() < 0.0 => {
                situation.artefact_shift += shift;
            }
            Injection::ThicknessShift(thickness) => situation.thickness_mm += thickness,
            _ => {}
        }
    }

    fn after(&self, situation: &Situation, reading: f64) -> f64 {
        let (channel, slide) = (situation.channel, situation.slide);
        let beyond = self
            .effect
            .shown_beyond(&self.zero, channel, slide, situation.time, reading);
        let part = (slide - self.travel.0) / (self.travel.1 - self.travel.0);
        reading
            + beyond
            + self.effect.dirt(channel, situation.repeat, slide)
            + channel.indicator_sign() * self.effect.sag(part)
            + match self.effect {
                Injection::Hysteresis(width) => self.play(situation, reading, width) - reading,
                Injection::TipRadius(radius) => {
                    let side = &self.sides[usize::from(!channel.is_side_a())];
                    let at = slide - situation.artefact_shift;
                    let slope = (side.at(at + 0.01) - side.at(at - 0.01)) / 0.02e3;
                    0.5e3 * radius * slope * slope
                }
                _ => 0.0,
            }
    }
}
