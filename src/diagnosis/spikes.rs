//! Heavy tails: single readings that stand out of their neighbours and of their own repeats.
//!
//! One such reading carries more weight than a hundred others, swells the noise and passes for dirt.
//! It is pulled in to the edge of what noise does (Huber's winsorising) before anything is tested,
//! so that noise, tests and sizes all see the same readings.

use std::collections::BTreeMap;

use errsep_models::model::FittedModel;
use nalgebra::DVector;

/// Standard deviations to which a reading is pulled in.
const EDGE: f64 = 4.0;
/// Repeats without which a spike cannot be told from a form.
const REPEATS: usize = 3;

/// The readings with single spikes pulled in, and their number.
///
/// A spike of height h in a trace makes the second differences −h/2, h, −h/2; a step, a bump wider
/// than the spacing, or whatever comes back in the other repeats does not.
pub(super) fn pulled_in<M: FittedModel>(
    model: &M,
    readings: &DVector<f64>,
) -> (DVector<f64>, usize) {
    let mut groups: BTreeMap<(Vec<usize>, bool), Vec<usize>> = BTreeMap::new();
    for (t, trace) in model.traces().iter().enumerate() {
        let places = &model.places()[trace.clone()];
        let cells = places.iter().map(|p| p.cell).collect();
        let backward = places.first().is_some_and(|p| p.direction < 0.0);
        groups.entry((cells, backward)).or_default().push(t);
    }
    let mut bent: DVector<f64> = DVector::zeros(readings.len());
    let mut sizes = Vec::new();
    for group in groups.values().filter(|g| g.len() >= REPEATS) {
        let length = model.traces()[group[0]].len();
        for k in 1..length.saturating_sub(1) {
            let rows: Vec<usize> = group.iter().map(|t| model.traces()[*t].start + k).collect();
            let own: Vec<f64> = rows
                .iter()
                .map(|r| readings[*r] - 0.5 * (readings[r - 1] + readings[r + 1]))
                .collect();
            let usual = median(&mut own.clone());
            for (row, value) in rows.into_iter().zip(own) {
                bent[row] = value - usual;
                sizes.push((value - usual).abs());
            }
        }
    }
    let mut calm = readings.clone();
    if sizes.is_empty() {
        return (calm, 0);
    }
    // 1.4826: the standard deviation of normal numbers over the median of their absolute values.
    let edge = EDGE * 1.4826 * median(&mut sizes);
    let mut count = 0;
    for trace in model.traces() {
        for k in trace.clone().skip(1).take(trace.len().saturating_sub(2)) {
            let height = bent[k];
            let half = |side: f64| (0.25..=0.75).contains(&(-side / height));
            // Next to an end only one neighbour has a second difference.
            let left = k == trace.start + 1 || half(bent[k - 1]);
            let right = k + 2 == trace.end || half(bent[k + 1]);
            if height.abs() > edge && left && right {
                calm[k] -= height - edge.copysign(height);
                count += 1;
            }
        }
    }
    (calm, count)
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n % 2 == 1 {
        values[n / 2]
    } else {
        0.5 * (values[n / 2 - 1] + values[n / 2])
    }
}
