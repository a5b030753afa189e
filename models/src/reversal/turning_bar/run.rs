//! The readings of a run, checked: the slide feeds one way while the spindle turns.

use std::f64::consts::TAU;

use super::error::TurningError;

/// Fewest turns of a run.
pub const FEWEST_TURNS: f64 = 3.0;
/// Fewest readings of a turn.
pub const FEWEST_PER_TURN: f64 = 12.0;
/// Fewest readings of a run.
pub const FEWEST_READINGS: usize = 60;
/// By so much, degrees, a recorded angle may go back without being a jump: the resolution of a mark.
const BACK_DEG: f64 = 2.0;
/// By this part of its travel the slide may go back: the resolution of its scale.
const SLIDE_BACK: f64 = 1e-3;

/// One reading of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningReading {
    /// Seconds; `None` in a run of which the angles alone are known.
    pub time: Option<f64>,
    /// Position of the slide, mm.
    pub x: f64,
    /// What the indicator shows, µm.
    pub value: f64,
    /// Recorded angle of the spindle, degrees: of any number of turns, or from 0 to 360 anew each turn.
    pub spindle: Option<f64>,
}

/// A run in which nothing contradicts itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Seconds, growing; the number of the reading where no times are known.
    pub time: Vec<f64>,
    /// Whether `time` is in seconds.
    pub timed: bool,
    /// Position of the slide, mm.
    pub x: Vec<f64>,
    /// Readings, µm.
    pub value: Vec<f64>,
    /// Recorded angle of the spindle, rad, without jumps between turns.
    pub angle: Option<Vec<f64>>,
    /// +1 where x grows with time, −1 where it falls.
    pub direction: f64,
}

impl Run {
    /// A run of readings in the order in which they were taken.
    ///
    /// # Errors
    /// [`TurningError`]: what contradicts itself, and which reading.
    pub fn new(readings: &[TurningReading]) -> Result<Self, TurningError> {
        if readings.len() < FEWEST_READINGS {
            return Err(TurningError::TooFew {
                readings: readings.len(),
            });
        }
        for (index, r) in readings.iter().enumerate() {
            let figures = [
                ("time", r.time.unwrap_or(0.0)),
                ("position", r.x),
                ("reading", r.value),
                ("spindle angle", r.spindle.unwrap_or(0.0)),
            ];
            if let Some((what, _)) = figures.iter().find(|f| !f.1.is_finite()) {
                return Err(TurningError::NotFinite { index, what });
            }
        }
        let timed = readings.iter().all(|r| r.time.is_some());
        let angle = readings
            .iter()
            .map(|r| r.spindle)
            .collect::<Option<Vec<f64>>>();
        if !timed && angle.is_none() {
            return Err(TurningError::NoClock);
        }
        let time: Vec<f64> = readings
            .iter()
            .enumerate()
            .map(|(i, r)| r.time.filter(|_| timed).unwrap_or(i as f64))
            .collect();
        if let Some(i) = time.windows(2).position(|w| w[1] <= w[0]) {
            return Err(TurningError::Time { index: i + 1 });
        }
        let x: Vec<f64> = readings.iter().map(|r| r.x).collect();
        let direction = travel(&x)?;
        let angle = angle.map(|degrees| unwrapped(&degrees)).transpose()?;
        let run = Self {
            time,
            timed,
            x,
            value: readings.iter().map(|r| r.value).collect(),
            angle,
            direction,
        };
        if let Some(turns) = run.recorded_turns() {
            enough(turns, run.len())?;
        }
        Ok(run)
    }

    /// Number of readings.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// First and last time.
    pub fn times(&self) -> (f64, f64) {
        (self.time[0], self.time[self.len() - 1])
    }

    /// Least and greatest position, mm.
    pub fn range(&self) -> (f64, f64) {
        let low = self.x.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (low, high)
    }

    /// Turns between the first and the last recorded angle.
    pub fn recorded_turns(&self) -> Option<f64> {
        let angle = self.angle.as_ref()?;
        Some((angle[angle.len() - 1] - angle[0]).abs() / TAU)
    }

    /// The readings of which `keep` says so, by their number.
    #[must_use]
    pub fn part(&self, keep: impl Fn(usize) -> bool) -> Self {
        let of = |all: &[f64]| -> Vec<f64> {
            let kept = all.iter().enumerate().filter(|(i, _)| keep(*i));
            kept.map(|(_, v)| *v).collect()
        };
        Self {
            time: of(&self.time),
            timed: self.timed,
            x: of(&self.x),
            value: of(&self.value),
            angle: self.angle.as_deref().map(of),
            direction: self.direction,
        }
    }
}

/// Whether so many turns and readings make a run.
///
/// # Errors
/// [`TurningError::TooFewTurns`] and [`TurningError::TooFewPerTurn`].
pub fn enough(turns: f64, readings: usize) -> Result<(), TurningError> {
    let rounded = |value: f64| (10.0 * value).round() / 10.0;
    if turns < FEWEST_TURNS {
        return Err(TurningError::TooFewTurns {
            turns: rounded(turns),
        });
    }
    let per_turn = readings as f64 / turns;
    if per_turn < FEWEST_PER_TURN {
        return Err(TurningError::TooFewPerTurn {
            readings: rounded(per_turn),
        });
    }
    Ok(())
}

/// Which way the slide goes; it may not turn back.
fn travel(x: &[f64]) -> Result<f64, TurningError> {
    let whole = x[x.len() - 1] - x[0];
    if whole == 0.0 {
        return Err(TurningError::NoTravel { x_mm: x[0] });
    }
    let direction = whole.signum();
    let mut furthest = direction * x[0];
    for (index, x) in x.iter().enumerate() {
        let here = direction * x;
        if furthest - here > SLIDE_BACK * whole.abs() {
            return Err(TurningError::SlideBack {
                index,
                by_mm: furthest - here,
            });
        }
        furthest = furthest.max(here);
    }
    Ok(direction)
}

/// Recorded degrees as radians without jumps between turns.
///
/// Angles beyond one turn are counted through; others begin anew each turn, where each step is the
/// shorter way round.
fn unwrapped(degrees: &[f64]) -> Result<Vec<f64>, TurningError> {
    let low = degrees.iter().copied().fold(f64::INFINITY, f64::min);
    let high = degrees.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let anew = high - low <= 360.0;
    let mut through = Vec::with_capacity(degrees.len());
    let mut at = degrees[0];
    through.push(at);
    for pair in degrees.windows(2) {
        let step = pair[1] - pair[0];
        at += if anew {
            (step + 180.0).rem_euclid(360.0) - 180.0
        } else {
            step
        };
        through.push(at);
    }
    let onward = (at - degrees[0]).signum();
    for (i, pair) in through.windows(2).enumerate() {
        let back = onward * (pair[0] - pair[1]);
        if back > BACK_DEG {
            return Err(TurningError::JumpsBack {
                index: i + 1,
                degrees: back,
            });
        }
    }
    Ok(through.into_iter().map(f64::to_radians).collect())
}
