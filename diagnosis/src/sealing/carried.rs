//! What is taken over from one measurement to another, and what is fitted anew.

use std::collections::BTreeMap;

use errsep_models::model::{AnyModel, FittedModel, Place};
use nalgebra::{DMatrix, DVector};

use crate::detection::basis::orthonormal;
use crate::sealing::forecast::NotSealed;

/// Parts of the range by which positions may differ and still be the same, and lie beyond its ends.
const SAME: f64 = 1e-6;

/// The values at planned readings as sums of those at readings that were taken: between positions the cubic
/// through the four neighbours.
pub(super) struct Carried {
    /// By planned reading: rows of the measurement, with weights.
    rows: Vec<Vec<(usize, f64)>>,
}

impl Carried {
    /// From the places of a model to those of a plan, channel by channel.
    ///
    /// # Errors
    /// A channel was not read, or a position lies outside those that were.
    pub fn new(model: &AnyModel, plan: &AnyModel) -> Result<Self, NotSealed> {
        let (known, planned) = (model.channel_names(), plan.channel_names());
        let mut seen: BTreeMap<&str, Vec<(f64, usize)>> = BTreeMap::new();
        for (row, place) in model.places().iter().enumerate() {
            let own = seen.entry(known[place.channel].as_str()).or_default();
            own.push((place.x, row));
        }
        for nodes in seen.values_mut() {
            nodes.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let range = range_of(nodes);
            nodes.dedup_by(|b, a| b.0 - a.0 <= SAME * range);
        }
        let of = |place: &Place| {
            let channel = &planned[place.channel];
            let nodes = seen.get(channel.as_str());
            let nodes = nodes.ok_or_else(|| NotSealed::NoChannel(channel.clone()))?;
            between(nodes, place.x).ok_or_else(|| NotSealed::Beyond {
                channel: channel.clone(),
                x: place.x,
                range: [nodes[0].0, nodes[nodes.len() - 1].0],
            })
        };
        let rows: Result<Vec<_>, NotSealed> = plan.places().iter().map(of).collect();
        Ok(Self { rows: rows? })
    }

    /// Columns over the readings that were taken as columns over those planned.
    pub fn columns(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(self.rows.len(), columns.ncols(), |k, j| {
            self.rows[k]
                .iter()
                .map(|(row, w)| w * columns[(*row, j)])
                .sum()
        })
    }

    /// The same of one vector.
    pub fn vector(&self, values: &DVector<f64>) -> DVector<f64> {
        let of = |own: &Vec<(usize, f64)>| own.iter().map(|(row, w)| w * values[*row]).sum();
        DVector::from_iterator(self.rows.len(), self.rows.iter().map(of))
    }
}

fn range_of(nodes: &[(f64, usize)]) -> f64 {
    match (nodes.first(), nodes.last()) {
        (Some(first), Some(last)) => last.0 - first.0,
        _ => 0.0,
    }
}

/// The value at a place as a sum of those at nodes that grow: by the cubic through its four neighbours;
/// nothing outside.
pub(super) fn between(nodes: &[(f64, usize)], x: f64) -> Option<Vec<(usize, f64)>> {
    let slack = SAME * range_of(nodes);
    let (first, last) = (nodes.first()?.0, nodes.last()?.0);
    if !(x >= first - slack && x <= last + slack) {
        return None;
    }
    if let Some((_, row)) = nodes.iter().find(|n| (n.0 - x).abs() <= slack) {
        return Some(vec![(*row, 1.0)]);
    }
    let after = nodes.partition_point(|n| n.0 < x);
    let count = nodes.len().min(4);
    let from = after.saturating_sub(2).min(nodes.len() - count);
    let own = &nodes[from..from + count];
    let weight = |node: f64| -> f64 {
        let others = own.iter().filter(|n| n.0 != node);
        others.map(|n| (x - n.0) / (node - n.0)).product()
    };
    Some(
        own.iter()
            .map(|(node, row)| (*row, weight(*node)))
            .collect(),
    )
}

/// What a new set-up changes in some readings, which is taken out of everything that is compared.
pub(super) struct Anew(DMatrix<f64>);

impl Anew {
    /// By the changes of the readings, readings × unknowns.
    pub fn new(columns: &DMatrix<f64>) -> Self {
        let sizes: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
        Self(orthonormal(columns, &sizes))
    }

    /// Takes its least-squares fit out of each column.
    pub fn taken_out(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        if self.0.ncols() > 0 {
            let along = self.0.tr_mul(&columns);
            columns.gemm(-1.0, &self.0, &along, 1.0);
        }
        columns
    }

    /// Whether a weight of the readings does not see it.
    pub fn spares(&self, weights: &DVector<f64>) -> bool {
        self.0.tr_mul(weights).norm() <= SAME * weights.norm()
    }
}
