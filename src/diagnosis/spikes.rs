//! Heavy tails: single readings that stand out of their neighbours and of their own repeats.
//!
//! One such reading carries more weight than a hundred others, swells the noise and passes for dirt.
//! It is pulled in to the edge of what noise does (Huber's winsorising) before anything is tested,
//! so that noise, tests and sizes all see the same readings. Where such readings are too many for
//! normal noise with a few accidents, the noise itself has heavy tails: then the edge is nearer.

use std::collections::BTreeMap;

use errsep_models::model::FittedModel;
use nalgebra::DVector;

/// Standard deviations to which a reading is pulled in.
const EDGE: f64 = 4.0;
/// The same where the noise has heavy tails.
const NEAR_EDGE: f64 = 2.0;
/// Part of the readings beyond three standard deviations (normal noise: 0.003) that makes tails heavy.
const HEAVY: f64 = 0.01;
/// Repeats without which a spike cannot be told from a form.
const REPEATS: usize = 3;
/// A spike has no neighbours: it keeps this part of its height over the nearer ones.
const ALONE: f64 = 0.6;

/// Readings with single spikes pulled in.
pub(super) struct Calmed {
    pub readings: DVector<f64>,
    /// Number of readings that were pulled in.
    pub count: usize,
    /// Standard deviations beyond which they were.
    pub edge: f64,
}

/// How far a reading is from its other repeats, over its neighbours.
struct Height {
    row: usize,
    /// Over the two neighbours on either side.
    near: f64,
    /// Over the seven.
    far: f64,
    /// Whether no other repeat stands farther from what is usual there.
    farthest: bool,
}

impl Height {
    fn stands_out(&self, edge: f64) -> bool {
        self.farthest && self.near.abs() > edge && self.near.abs() > ALONE * self.far.abs()
    }
}

/// Pulls single spikes in.
///
/// The deviation of a reading from the median of its other repeats holds no form; less the median of
/// its four neighbours it holds no step, no drift and nothing wider than a reading or two; a bump,
/// of which the nearer neighbours have their part, is not alone.
pub(super) fn pulled_in<M: FittedModel>(model: &M, readings: &DVector<f64>) -> Calmed {
    let mut groups: BTreeMap<(Vec<usize>, bool), Vec<usize>> = BTreeMap::new();
    for (t, trace) in model.traces().iter().enumerate() {
        let places = &model.places()[trace.clone()];
        let cells = places.iter().map(|p| p.cell).collect();
        let backward = places.first().is_some_and(|p| p.direction < 0.0);
        groups.entry((cells, backward)).or_default().push(t);
    }
    let mut heights: Vec<Height> = Vec::new();
    for group in groups.values().filter(|g| g.len() >= REPEATS) {
        let starts: Vec<usize> = group.iter().map(|t| model.traces()[*t].start).collect();
        let length = model.traces()[group[0]].len();
        for (own, start) in starts.iter().enumerate() {
            // Less the others' median; and whether no other repeat is farther from all their median.
            let away: Vec<(f64, bool)> = (0..length)
                .map(|k| {
                    let all: Vec<f64> = starts.iter().map(|s| readings[s + k]).collect();
                    let mut others = all.clone();
                    others.remove(own);
                    let usual = median(&mut all.clone());
                    let distance = |value: &f64| (value - usual).abs();
                    let farthest = all.iter().all(|v| distance(v) <= distance(&all[own]));
                    (all[own] - median(&mut others), farthest)
                })
                .collect();
            let over = |k: usize, reach: usize| {
                let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(length));
                let mut others: Vec<f64> =
                    (from..to).filter(|j| *j != k).map(|j| away[j].0).collect();
                away[k].0 - median(&mut others)
            };
            heights.extend((0..length).map(|k| Height {
                row: start + k,
                near: over(k, 2),
                far: over(k, 7),
                farthest: away[k].1,
            }));
        }
    }
    let mut calmed = Calmed {
        readings: readings.clone(),
        count: 0,
        edge: EDGE,
    };
    if heights.is_empty() {
        return calmed;
    }
    // 1.4826: the standard deviation of normal numbers over the median of their absolute values.
    let mut sizes: Vec<f64> = heights.iter().map(|h| h.near.abs()).collect();
    let sigma = 1.4826 * median(&mut sizes);
    let beyond = heights.iter().filter(|h| h.stands_out(3.0 * sigma)).count();
    if beyond as f64 > HEAVY * heights.len() as f64 {
        calmed.edge = NEAR_EDGE;
    }
    let edge = calmed.edge * sigma;
    for height in heights.iter().filter(|h| h.stands_out(edge)) {
        calmed.readings[height.row] -= height.near - edge.copysign(height.near);
        calmed.count += 1;
    }
    calmed
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        0.0
    } else if n % 2 == 1 {
        values[n / 2]
    } else {
        0.5 * (values[n / 2 - 1] + values[n / 2])
    }
}
