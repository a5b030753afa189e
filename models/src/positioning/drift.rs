//! Drift of the deviations over time: one slope common to all targets and directions.
//!
//! A run that was zeroed anew lies at a height of its own, and so does one that a drift has shifted. The
//! heights of the runs are therefore what is independent, not the readings: all readings of a run share
//! its height, and within a run the times go with the targets.

use std::collections::{BTreeMap, BTreeSet};

use super::dependence::LEVEL;
use super::readings::{Direction, Reading, mean};
use crate::missing::heights;
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
        let runs: BTreeSet<u32> = readings.iter().map(|r| r.run).collect();
        let place: BTreeMap<u32, usize> = runs.iter().copied().zip(0..).collect();
        let mut cells: BTreeMap<(u64, Direction), [Vec<Option<f64>>; 2]> = BTreeMap::new();
        let mut counts = vec![0.0; runs.len()];
        for r in readings {
            let time = r.time?;
            let run = *place.get(&r.run)?;
            let rows = cells
                .entry(((r.target + 0.0).to_bits(), r.direction))
                .or_insert_with(|| [vec![None; runs.len()], vec![None; runs.len()]]);
            rows[0][run] = Some(time);
            rows[1][run] = Some(r.deviation);
            counts[run] += 1.0;
        }
        let times = || readings.iter().filter_map(|r| r.time);
        let duration =
            times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min);
        let degrees_of_freedom = runs.len().checked_sub(2).filter(|f| *f > 0)?;
        // Times and heights of the runs, both freed of targets and directions.
        let [time, height] = [0, 1].map(|k| {
            let rows = cells.values().map(|rows| rows[k].as_slice());
            let mut own = heights(rows, runs.len());
            let weighted = own.iter().zip(&counts).map(|(z, n)| z * n);
            let mean = weighted.sum::<f64>() / readings.len() as f64;
            own.iter_mut().for_each(|z| *z -= mean);
            own
        });
        let sum = |a: &[f64], b: &[f64]| -> f64 {
            let both = a.iter().zip(b).zip(&counts);
            both.map(|((a, b), n)| n * a * b).sum()
        };
        let (tt, tx, xx) = (
            sum(&time, &time),
            sum(&time, &height),
            sum(&height, &height),
        );
        // Times that differ by rounding alone tell no slope.
        if !(tt.sqrt() > 1e-9 * duration) || !tt.is_finite() {
            return None;
        }
        let rate = tx / tt;
        let about = (xx - rate * tx).max(0.0);
        let std = (about / degrees_of_freedom as f64 / tt).sqrt();
        let squares: f64 = cells
            .values()
            .map(|[_, row]| {
                let mean = mean(row);
                row.iter()
                    .flatten()
                    .map(|v| (v - mean).powi(2))
                    .sum::<f64>()
            })
            .sum();
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
