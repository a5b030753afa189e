//! Positions at which the channels are combined.

use super::trace::Trace;

/// Positions closer than this share of the range are the same.
const SAME: f64 = 1e-9;

/// The common grid of traces, and whether it is simply their own.
///
/// Traces of one grid keep it. Otherwise it is the grid of the trace with the fewest positions inside
/// the range that all cover: no trace is asked for detail that it does not have.
pub fn common_grid(traces: &[Trace]) -> (Vec<f64>, bool) {
    let Some(first) = traces.first() else {
        return (Vec::new(), true);
    };
    let (from, to) = traces
        .iter()
        .map(Trace::range)
        .fold((f64::NEG_INFINITY, f64::INFINITY), |(from, to), (a, b)| {
            (from.max(a), to.min(b))
        });
    let tolerance = SAME * (first.range().1 - first.range().0);
    let is_same = |t: &Trace| {
        t.x.len() == first.x.len()
            && t.x
                .iter()
                .zip(&first.x)
                .all(|(a, b)| (a - b).abs() <= tolerance)
    };
    if traces.iter().all(is_same) {
        return (first.x.clone(), true);
    }
    let inside = |t: &Trace| {
        t.x.iter()
            .copied()
            .filter(|x| (from - tolerance..=to + tolerance).contains(x))
            .collect::<Vec<_>>()
    };
    let coarsest = traces.iter().map(inside).min_by_key(Vec::len);
    (coarsest.unwrap_or_default(), false)
}

/// For each position of `grid`, the readings behind the nearest mean of a trace.
pub fn counts_near(trace: &Trace, grid: &[f64]) -> Vec<f64> {
    let last = trace.x.len().saturating_sub(1);
    grid.iter()
        .map(|&p| {
            let right = trace.x.partition_point(|&x| x < p).min(last);
            let left = right.saturating_sub(1);
            let nearest = if (trace.x[left] - p).abs() <= (trace.x[right] - p).abs() {
                left
            } else {
                right
            };
            trace.count[nearest]
        })
        .collect()
}
