//! Repeats that each drift by a line of their own.
//!
//! An indicator or a machine that warms up tilts a whole trace. Beside that the scatter of repeats is no noise of single
//! readings, and the slope of a channel, the mean over its traces, is no surer than the slopes of these agree. What the slide
//! does anew in each pass both indicators read at once, one with the other sign: the channels of one position of the spindle
//! are correlated then.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

use super::trace::Trace;
use crate::reversal::{Channel, Direction, Observations};

/// Drifts are told where noise of single readings makes slopes of repeats differ as much less often than this.
const SEEN: f64 = 0.05;
/// The same for a correlation of readings, of which there are many: what matters shows clearly.
const CLEAR: f64 = 1e-3;
/// Positions of a trace that tell its slope.
const FEWEST: usize = 3;

/// What the slopes of one channel's repeats differ by.
#[derive(Default)]
struct Slopes {
    /// Slope of each trace about the mean of its direction, µm/mm.
    by_trace: BTreeMap<Key, f64>,
    freedom: usize,
    /// Σ b² Sxx, µm².
    of_readings: f64,
    /// Σ 1/Sxx, 1/mm².
    inverse: f64,
}

/// Direction and number of a trace.
type Key = (Direction, u32);

/// What drifts of repeats add to the slopes of the channels.
pub(super) struct Drifts {
    /// To their covariance, (µm/mm)².
    pub(super) covariance: DMatrix<f64>,
    /// Degrees of freedom that it is known with.
    pub(super) freedom: f64,
}

/// Takes the lines by which repeats differ out of the scatter where they stand out of it, and gives what they add
/// to the slopes of the channels; zeros where they do not.
pub(super) fn take_out(observations: &Observations, traces: &mut [Trace]) -> Drifts {
    let mut added = Drifts {
        covariance: DMatrix::zeros(traces.len(), traces.len()),
        freedom: f64::INFINITY,
    };
    let whole: usize = traces.iter().map(|t| t.scatter_freedom).sum();
    if whole == 0 {
        return added;
    }
    let all: Vec<Slopes> = traces.iter().map(|t| slopes(observations, t)).collect();
    let freedom: usize = all.iter().map(|s| s.freedom).sum();
    let scatter: f64 = traces.iter().map(|t| t.scatter).sum();
    let of_readings: f64 = all.iter().map(|s| s.of_readings).sum();
    if freedom == 0 || whole <= freedom || scatter <= of_readings {
        return added;
    }
    let rest = (scatter - of_readings) / (whole - freedom) as f64;
    let ratio = of_readings / freedom as f64 / rest;
    let law = FisherSnedecor::new(freedom as f64, (whole - freedom) as f64);
    if !law.is_ok_and(|law| law.sf(ratio) < SEEN) {
        return added;
    }
    // The same drift in all channels; what noise makes of slopes is counted already.
    let slopes = || all.iter().flat_map(|s| s.by_trace.values());
    let squares: f64 = slopes().map(|b| b * b).sum();
    let of_noise = rest * all.iter().map(|s| s.inverse).sum::<f64>() / slopes().count() as f64;
    let variance = (squares / freedom as f64 - of_noise).max(0.0);
    for (trace, own) in traces.iter_mut().zip(&all) {
        trace.scatter -= own.of_readings;
        trace.scatter_freedom -= own.freedom;
    }
    let count = |c: usize| all[c].by_trace.len().max(1) as f64;
    for c in 0..traces.len() {
        added.covariance[(c, c)] = variance / count(c);
    }
    let pairs = opposite(traces);
    let both = |a: usize, b: usize| {
        let other = &all[b].by_trace;
        (all[a].by_trace.iter()).filter_map(move |(key, own)| Some((*own, *other.get(key)?)))
    };
    let lost = pairs.len() as f64 * (slopes().count() - freedom) as f64 / traces.len() as f64;
    let products = pairs.iter().flat_map(|(a, b)| both(*a, *b));
    // Noise of readings is in the squares, and not in the products.
    let shared = correlation(products, lost, SEEN) * (variance + of_noise);
    let shared = shared.clamp(-variance, variance);
    for (a, b) in pairs {
        let covariance = shared / (count(a) * count(b)).sqrt();
        added.covariance[(a, b)] = covariance;
        added.covariance[(b, a)] = covariance;
    }
    // Of two traces that share theirs one tells no more than the other.
    let alone = 1.0 - 0.5 * shared.abs() / variance.max(f64::MIN_POSITIVE);
    added.freedom = freedom as f64 * alone;
    added
}

/// Correlation between opposite indicators of what the readings of one pass lie beside the mean of the repeats and the line of
/// the trace; zero where it is none clearly.
pub(super) fn shared(observations: &Observations, traces: &[Trace]) -> f64 {
    if traces.iter().all(|t| t.scatter_freedom == 0) {
        return 0.0;
    }
    let pairs = opposite(traces);
    let left: Vec<BTreeMap<(Key, u64), f64>> = (traces.iter())
        .map(|t| {
            let mut left = BTreeMap::new();
            for (key, points) in about_mean(observations, t) {
                let (slope, _) = slope(&points).unwrap_or((0.0, 1.0));
                let n = points.len().max(1) as f64;
                let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
                let (x, y) = (mean(|p| p.0), mean(|p| p.1));
                let rest = |p: &(f64, f64)| ((key, p.0.to_bits()), p.1 - y - slope * (p.0 - x));
                left.extend(points.iter().map(rest));
            }
            left
        })
        .collect();
    let both = pairs.iter().flat_map(|(a, b)| {
        let other = &left[*b];
        (left[*a].iter()).filter_map(move |(key, own)| Some((*own, *other.get(key)?)))
    });
    let means: BTreeSet<(Direction, u64)> = left
        .iter()
        .flat_map(|l| l.keys().map(|((direction, _), x)| (*direction, *x)))
        .collect();
    correlation(both, (pairs.len() * means.len()) as f64, CLEAR)
}

/// Channels that opposite indicators read at one position of the spindle.
pub(super) fn opposite(traces: &[Trace]) -> Vec<(usize, usize)> {
    let place = |channel| traces.iter().position(|t| t.channel == channel);
    let pairs = [(Channel::C1A, Channel::C1B), (Channel::C2A, Channel::C2B)];
    let both = |(a, b)| Some((place(a)?, place(b)?));
    pairs.into_iter().filter_map(both).collect()
}

/// The correlation of pairs of deviations of which so many are not free; zero where independent ones would have as much more
/// often than so.
fn correlation(pairs: impl Iterator<Item = (f64, f64)>, not_free: f64, often: f64) -> f64 {
    let (mut product, mut squares, mut count) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        product += a * b;
        squares += 0.5 * (a * a + b * b);
        count += 1.0;
    }
    let freedom = count - not_free;
    if !(squares > 0.0 && freedom > 1.0) {
        return 0.0;
    }
    let r: f64 = product / squares;
    let t = r.abs() * ((freedom - 1.0) / (1.0 - r * r).max(f64::MIN_POSITIVE)).sqrt();
    let law = StudentsT::new(0.0, 1.0, freedom - 1.0);
    match law {
        Ok(law) if 2.0 * law.sf(t) < often => r,
        _ => 0.0,
    }
}

/// By trace of a channel, the positions that other repeats have too, and how far its readings lie above the mean there.
fn about_mean(observations: &Observations, trace: &Trace) -> BTreeMap<Key, Vec<(f64, f64)>> {
    let mut means: BTreeMap<(Direction, u64), (f64, f64)> = BTreeMap::new();
    for r in observations.of(trace.channel) {
        let place = means.entry((r.direction, r.x.to_bits())).or_default();
        *place = (place.0 + r.value, place.1 + 1.0);
    }
    let mut apart: BTreeMap<Key, Vec<(f64, f64)>> = BTreeMap::new();
    for r in observations.of(trace.channel) {
        let (sum, count) = means[&(r.direction, r.x.to_bits())];
        if count > 1.0 {
            let own = apart.entry((r.direction, r.repeat)).or_default();
            own.push((r.x, r.value - sum / count));
        }
    }
    apart
}

/// Slopes of the repeats of a channel about their common form.
fn slopes(observations: &Observations, trace: &Trace) -> Slopes {
    let mut found = Slopes::default();
    let mut directions = BTreeSet::new();
    for (key, points) in about_mean(observations, trace) {
        if let Some((slope, spread)) = slope(&points) {
            directions.insert(key.0);
            found.by_trace.insert(key, slope);
            found.of_readings += slope * slope * spread;
            found.inverse += 1.0 / spread;
        }
    }
    found.freedom = found.by_trace.len() - directions.len();
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
