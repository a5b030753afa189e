//! Repeats that each drift by a line of their own.
//!
//! An indicator or a machine that warms up tilts a whole trace. Beside that the scatter of repeats is no noise of single
//! readings, and the slope of a channel, the mean over its traces, is no surer than the slopes of these agree.

use std::collections::BTreeMap;

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::trace::Trace;
use crate::reversal::{Direction, Observations};

/// Drifts are told where noise of single readings makes slopes of repeats differ as much less often than this.
const SEEN: f64 = 0.05;
/// Positions of a trace that tell its slope.
const FEWEST: usize = 3;

/// Squares of the slopes of one channel's repeats.
#[derive(Default)]
struct Slopes {
    traces: f64,
    freedom: usize,
    /// Σ b², (µm/mm)².
    squares: f64,
    /// Σ b² Sxx, µm².
    of_readings: f64,
    /// Σ 1/Sxx, 1/mm².
    inverse: f64,
}

/// Takes the lines by which repeats differ out of the scatter where they stand out of it, and gives the variance that they add
/// to the slope of each channel, (µm/mm)²; zeros where they do not.
pub(super) fn take_out(observations: &Observations, traces: &mut [Trace]) -> Vec<f64> {
    let all: Vec<Slopes> = traces.iter().map(|t| slopes(observations, t)).collect();
    let freedom: usize = all.iter().map(|s| s.freedom).sum();
    let scatter: f64 = traces.iter().map(|t| t.scatter).sum();
    let whole: usize = traces.iter().map(|t| t.scatter_freedom).sum();
    let of_readings: f64 = all.iter().map(|s| s.of_readings).sum();
    let none = vec![0.0; traces.len()];
    if freedom == 0 || whole <= freedom || scatter <= of_readings {
        return none;
    }
    let rest = (scatter - of_readings) / (whole - freedom) as f64;
    let ratio = of_readings / freedom as f64 / rest;
    let law = FisherSnedecor::new(freedom as f64, (whole - freedom) as f64);
    if !law.is_ok_and(|law| law.sf(ratio) < SEEN) {
        return none;
    }
    // The same drift in all channels; what noise makes of slopes is counted already.
    let squares: f64 = all.iter().map(|s| s.squares).sum();
    let count: f64 = all.iter().map(|s| s.traces).sum();
    let of_noise = rest * all.iter().map(|s| s.inverse).sum::<f64>() / count;
    let variance = (squares / freedom as f64 - of_noise).max(0.0);
    for (trace, own) in traces.iter_mut().zip(&all) {
        trace.scatter -= own.of_readings;
        trace.scatter_freedom -= own.freedom;
    }
    all.iter().map(|s| variance / s.traces.max(1.0)).collect()
}

/// Slopes of the repeats of a channel about their common form.
fn slopes(observations: &Observations, trace: &Trace) -> Slopes {
    let mut found = Slopes::default();
    for direction in [Direction::Forward, Direction::Backward] {
        let mut repeats: BTreeMap<u32, Vec<(f64, f64)>> = BTreeMap::new();
        let mut places: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
        let own = observations.of(trace.channel);
        for r in own.filter(|r| r.direction == direction) {
            repeats.entry(r.repeat).or_default().push((r.x, r.value));
            let place = places.entry(r.x.to_bits()).or_default();
            *place = (place.0 + r.value, place.1 + 1.0);
        }
        let slopes: Vec<(f64, f64)> = repeats
            .values()
            .filter_map(|own| {
                let apart: Vec<(f64, f64)> = own
                    .iter()
                    .filter_map(|(x, y)| {
                        let (sum, count) = places[&x.to_bits()];
                        (count > 1.0).then(|| (*x, y - sum / count))
                    })
                    .collect();
                slope(&apart)
            })
            .collect();
        found.traces += slopes.len() as f64;
        found.freedom += slopes.len().saturating_sub(1);
        for (slope, spread) in slopes {
            found.squares += slope * slope;
            found.of_readings += slope * slope * spread;
            found.inverse += 1.0 / spread;
        }
    }
    found
}

/// Slope of the least-squares line and Σ(x − x̄)².
fn slope(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let spread: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let product: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    (points.len() >= FEWEST && spread > 0.0).then(|| (product / spread, spread))
}
