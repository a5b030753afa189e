//! Traces on the same cells, and how single readings stand over their neighbours there.

use std::collections::BTreeMap;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;

use crate::levels::{KEPT, SPIKE};

/// Neighbours on one side.
const SIDE: usize = 7;
/// Those over whose median a height is taken. At an end of a trace they lie on one side, and a slope makes heights.
pub(crate) const NEAR: usize = 2;

/// Traces of one channel on the same cells: of one direction, or of both where one alone has too few.
pub(crate) struct Pile {
    /// The rows of each trace, in the order of the cells.
    pub traces: Vec<Vec<usize>>,
    pub backward: Vec<bool>,
}

/// Deviations along a trace, and their heights over the neighbours.
pub(crate) type Heights = (Vec<f64>, Vec<f64>);

pub(crate) struct Group {
    pub starts: Vec<usize>,
    pub length: usize,
}

/// Traces on the same cells in the same direction.
pub(crate) fn groups(model: &AnyModel) -> impl Iterator<Item = Group> {
    let mut groups: BTreeMap<(Vec<usize>, bool), Group> = BTreeMap::new();
    for trace in model.traces() {
        let places = &model.places()[trace.clone()];
        let cells = places.iter().map(|p| p.cell).collect();
        let backward = places.first().is_some_and(|p| p.direction < 0.0);
        groups
            .entry((cells, backward))
            .or_insert_with(|| Group {
                starts: Vec::new(),
                length: trace.len(),
            })
            .starts
            .push(trace.start);
    }
    groups.into_values()
}

/// Deviations along a trace with their heights over the median of four neighbours.
pub(crate) fn over_neighbours(away: Vec<f64>) -> Heights {
    let near = (0..away.len())
        .map(|k| away[k] - around(&away, k, NEAR))
        .collect();
    (away, near)
}

/// How high a spike may stand: by the median of all heights, which are `least` at least, as where readings are rounded so that most
/// repeats are the same; none where there are no heights.
pub(crate) fn edge(heights: &[Vec<Heights>], least: f64) -> Option<f64> {
    let all = heights.iter().flatten().flat_map(|(_, near)| near);
    let mut sizes: Vec<f64> = all.map(|h| h.abs()).collect();
    if sizes.is_empty() {
        return None;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    Some(SPIKE * (SIGMA * *median).max(least))
}

/// The standard deviation of normal numbers over the median of their absolute values.
pub(crate) const SIGMA: f64 = 1.4826;

impl Group {
    /// For each trace the deviations from the median of the other repeats.
    pub fn away(&self, readings: &DVector<f64>) -> Vec<Vec<f64>> {
        let traces = self.starts.iter().map(|s| (*s..s + self.length).collect());
        away(&traces.collect::<Vec<Vec<usize>>>(), readings)
    }
}

/// For each of some traces the deviations from the median of the others.
fn away(traces: &[Vec<usize>], readings: &DVector<f64>) -> Vec<Vec<f64>> {
    let mut others = Vec::with_capacity(traces.len());
    (0..traces.len())
        .map(|own| {
            (0..traces[own].len())
                .map(|k| {
                    others.clear();
                    let rest = traces.iter().enumerate().filter(|(j, _)| *j != own);
                    others.extend(rest.map(|(_, rows)| readings[rows[k]]));
                    readings[traces[own][k]] - median(&mut others)
                })
                .collect()
        })
        .collect()
}

impl Pile {
    /// The traces of a group, in the order of their cells.
    pub fn of(model: &AnyModel, group: &Group) -> Self {
        let places = model.places();
        let rows = |start: &usize| {
            let mut rows: Vec<usize> = (*start..start + group.length).collect();
            rows.sort_by_key(|row| places[*row].cell);
            rows
        };
        let backward = |start: &usize| places[*start].direction < 0.0;
        Self {
            traces: group.starts.iter().map(rows).collect(),
            backward: group.starts.iter().map(backward).collect(),
        }
    }

    /// For each trace the deviations from the median of the others, and their heights over the neighbours.
    pub fn heights(&self, readings: &DVector<f64>) -> Vec<Heights> {
        let away = away(&self.traces, readings);
        away.into_iter().map(over_neighbours).collect()
    }

    /// Whether no other repeat is farther from the median of all.
    pub fn farthest(&self, readings: &DVector<f64>, own: usize, k: usize) -> bool {
        let all: Vec<f64> = self.traces.iter().map(|t| readings[t[k]]).collect();
        let usual = median(&mut all.clone());
        let distance = |value: &f64| (value - usual).abs();
        all.iter().all(|v| distance(v) <= distance(&all[own]))
    }

    /// Whether the other traces of its direction do not show a height, where the pile is of both directions: what
    /// differs between these is no spike.
    pub fn is_of_one(&self, heights: &[Heights], own: usize, k: usize) -> bool {
        if self.backward.iter().all(|b| *b == self.backward[0]) {
            return true;
        }
        let height = heights[own].1[k];
        let alike = |j: &usize| *j != own && self.backward[*j] == self.backward[own];
        let mut others = (0..self.traces.len()).filter(alike).peekable();
        others.peek().is_some()
            && others.all(|j| (height - heights[j].1[k]) * height.signum() > KEPT * height.abs())
    }
}

/// Whether a height is that of a single value.
pub(crate) fn stands_out(values: &[f64], k: usize, height: f64) -> bool {
    let far = values[k] - around(values, k, SIDE);
    height.abs() > KEPT * far.abs() && alone(values, k, height)
}

/// Whether a value stands out of its neighbours on either side by a part of its height.
pub(crate) fn alone(values: &[f64], k: usize, height: f64) -> bool {
    let before = &values[k.saturating_sub(SIDE)..k];
    let after = &values[k + 1..(k + 1 + SIDE).min(values.len())];
    let stands_out = |side: &[f64]| {
        let mut sorted = [0.0; SIDE];
        let sorted = &mut sorted[..side.len()];
        sorted.copy_from_slice(side);
        (values[k] - median(sorted)) * height.signum() > KEPT * height.abs()
    };
    [before, after]
        .into_iter()
        .all(|side| side.is_empty() || stands_out(side))
}

/// The median of the neighbours up to a distance on either side.
fn around(values: &[f64], k: usize, reach: usize) -> f64 {
    let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(values.len()));
    let mut others = [0.0; 2 * SIDE];
    let left = k - from;
    let count = left + to - k - 1;
    others[..left].copy_from_slice(&values[from..k]);
    others[left..count].copy_from_slice(&values[k + 1..to]);
    median(&mut others[..count])
}

pub(crate) fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        0.0
    } else if n % 2 == 1 {
        values[n / 2]
    } else {
        0.5 * (values[n / 2 - 1] + values[n / 2])
    }
}
