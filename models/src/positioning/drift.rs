//! Drift of the deviations over time: one slope common to all targets and directions.

use std::collections::BTreeMap;

use super::dependence::LEVEL;
use super::readings::{Direction, Reading};
use crate::uncertainty::{DegreesOfFreedom, coverage_factor};

/// The common slope of the deviations over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Slope, µm or seconds of arc in a second.
    pub rate: f64,
    /// Its standard uncertainty.
    pub std: f64,
    /// Degrees of freedom of that: readings less targets and directions less one.
    pub degrees_of_freedom: usize,
    /// From the first to the last reading, s.
    pub duration: f64,
}

impl Drift {
    /// Whether the rate differs from none at the 1 % level.
    #[must_use]
    pub fn shows(&self) -> bool {
        let freedom = DegreesOfFreedom::new(self.degrees_of_freedom as f64);
        let factor = freedom.and_then(|freedom| coverage_factor(1.0 - LEVEL, freedom));
        factor.is_ok_and(|k| self.rate.abs() > k * self.std)
    }

    /// Least squares of x = a(target, direction) + rate · time. None where a reading has no time,
    /// where no target is read at two times, or where no reading is left to tell the scatter.
    #[must_use]
    pub fn of(readings: &[Reading]) -> Option<Self> {
        let mut groups: BTreeMap<(u64, Direction), Vec<(f64, f64)>> = BTreeMap::new();
        for r in readings {
            groups
                .entry(((r.target + 0.0).to_bits(), r.direction))
                .or_default()
                .push((r.time?, r.deviation));
        }
        let degrees_of_freedom = readings.len().checked_sub(groups.len() + 1)?;
        let times = || readings.iter().filter_map(|r| r.time);
        let duration =
            times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min);
        let mut centred = Vec::with_capacity(readings.len());
        for group in groups.values() {
            let n = group.len() as f64;
            let time = group.iter().map(|(t, _)| t).sum::<f64>() / n;
            let deviation = group.iter().map(|(_, x)| x).sum::<f64>() / n;
            centred.extend(group.iter().map(|(t, x)| (t - time, x - deviation)));
        }
        let square: f64 = centred.iter().map(|(t, _)| t * t).sum();
        // Times that differ by rounding alone tell no slope.
        if degrees_of_freedom == 0 || !(square.sqrt() > 1e-9 * duration) || !square.is_finite() {
            return None;
        }
        let rate = centred.iter().map(|(t, x)| t * x).sum::<f64>() / square;
        let left: f64 = centred.iter().map(|(t, x)| (x - rate * t).powi(2)).sum();
        let std = (left / degrees_of_freedom as f64 / square).sqrt();
        (rate.is_finite() && std.is_finite()).then_some(Self {
            rate,
            std,
            degrees_of_freedom,
            duration,
        })
    }
}
