//! Drift of the deviations over time: one slope common to all targets and directions.
//!
//! A run that was zeroed anew lies at a height of its own, and so does one that a drift has shifted. The
//! heights of the runs are therefore what is independent, not the readings: all readings of a run share
//! its height, and within a run the times go with the targets.

use std::collections::BTreeMap;

use super::dependence::LEVEL;
use super::readings::{Direction, Reading};
use crate::uncertainty::{DegreesOfFreedom, coverage_factor};

/// The common slope of the deviations over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Slope, µm or seconds of arc in a second.
    pub rate: f64,
    /// Its standard uncertainty, from the heights of the runs about the slope.
    pub std: f64,
    /// Degrees of freedom of that: runs less two.
    pub degrees_of_freedom: usize,
    /// From the first to the last reading, s.
    pub duration: f64,
    /// Whether readings that were all zeroed together would show this rate at the 1 % level.
    pub may: bool,
}

impl Drift {
    /// Whether the heights of the runs go with time, at the 1 % level.
    #[must_use]
    pub fn shows(&self) -> bool {
        beyond(self.rate, self.std, self.degrees_of_freedom)
    }

    /// Least squares of x = a(target, direction) + rate · time + z(run): the heights of the runs against
    /// their times. None where a reading has no time, with less than three runs, or where no target is
    /// read at two times.
    #[must_use]
    pub fn of(readings: &[Reading]) -> Option<Self> {
        let mut cells: BTreeMap<(u64, Direction), Mean> = BTreeMap::new();
        for r in readings {
            let cell = ((r.target + 0.0).to_bits(), r.direction);
            cells.entry(cell).or_default().add(r.time?, r.deviation);
        }
        let times = || readings.iter().filter_map(|r| r.time);
        let duration =
            times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min);
        let mut runs: BTreeMap<u32, Mean> = BTreeMap::new();
        let mut squares = 0.0;
        for r in readings {
            let (time, deviation) = cells
                .get(&((r.target + 0.0).to_bits(), r.direction))?
                .mean();
            let left = r.deviation - deviation;
            squares += left * left;
            runs.entry(r.run).or_default().add(r.time? - time, left);
        }
        let degrees_of_freedom = runs.len().checked_sub(2).filter(|f| *f > 0)?;
        let (mut tt, mut tx, mut xx) = (0.0, 0.0, 0.0);
        for run in runs.values() {
            let (t, x) = run.mean();
            tt += run.count * t * t;
            tx += run.count * t * x;
            xx += run.count * x * x;
        }
        // Times that differ by rounding alone tell no slope.
        if !(tt.sqrt() > 1e-9 * duration) || !tt.is_finite() {
            return None;
        }
        let rate = tx / tt;
        let about = (xx - rate * tx).max(0.0);
        let std = (about / degrees_of_freedom as f64 / tt).sqrt();
        let freedom = readings.len().saturating_sub(cells.len() + 1);
        let as_readings = ((squares - rate * tx).max(0.0) / freedom.max(1) as f64 / tt).sqrt();
        (rate.is_finite() && std.is_finite()).then_some(Self {
            rate,
            std,
            degrees_of_freedom,
            duration,
            may: beyond(rate, as_readings, freedom),
        })
    }
}

/// Whether a rate differs from none at the 1 % level.
fn beyond(rate: f64, std: f64, degrees_of_freedom: usize) -> bool {
    let freedom = DegreesOfFreedom::new(degrees_of_freedom as f64);
    let factor = freedom.and_then(|freedom| coverage_factor(1.0 - LEVEL, freedom));
    factor.is_ok_and(|k| rate.abs() > k * std)
}

/// Mean time and deviation, of sums.
#[derive(Default)]
struct Mean {
    count: f64,
    time: f64,
    deviation: f64,
}

impl Mean {
    fn add(&mut self, time: f64, deviation: f64) {
        self.count += 1.0;
        self.time += time;
        self.deviation += deviation;
    }

    fn mean(&self) -> (f64, f64) {
        (self.time / self.count, self.deviation / self.count)
    }
}
