//! The rows at a point, kept as one small triangle a group: other weights of the parts, and what
//! that does to the linear solution, without another pass over the rows.

use rayon::prelude::*;

use super::evaluate::{Evaluation, for_each_task};
use super::problem::{Parameters, StructuredProblem};
use super::sink::LEAST_COST;
use crate::linear::bordered::{Bordered, BorderedCovariance, Group, Solved};
use crate::problem::NoValue;

/// Fewer groups than this are not worth handing to another core.
const GROUPS_A_CORE: usize = 32;

/// All groups of a problem at a point, each part under a weight.
#[derive(Debug, Clone)]
pub(super) struct Gathered {
    band: usize,
    width: usize,
    border: usize,
    groups: Vec<Group>,
    costs: Vec<f64>,
    weights: Vec<f64>,
    vanished: bool,
}

impl Gathered {
    /// Compresses all rows at a point; every part has the weight one.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub fn new<P: StructuredProblem>(problem: &P, at: &Parameters) -> Result<Self, NoValue> {
        let prepared = problem.prepare(at)?;
        let mut all = Vec::new();
        let mut costs = vec![0.0; problem.part_count()];
        let vanished = for_each_task(problem, &prepared, |groups| {
            for group in &groups {
                costs[group.part] += group.cost;
            }
            all.extend(groups);
        })?;
        Ok(Self {
            band: problem.band_count(),
            width: problem.band_width(&prepared),
            border: problem.border_count(),
            groups: all,
            weights: vec![1.0; costs.len()],
            costs,
            vanished,
        })
    }

    /// Half the sum of squares of all rows under their weights.
    fn cost(&self) -> f64 {
        let weighted = self.costs.iter().zip(&self.weights);
        weighted.map(|(cost, weight)| weight * weight * cost).sum()
    }

    /// Cost and factorised system.
    pub fn evaluation(&self) -> Evaluation {
        let cost = self.cost();
        Evaluation {
            cost,
            system: self.system(),
            vanished: self.vanished && cost < LEAST_COST,
        }
    }

    /// Multiplies the rows of each part by a factor.
    pub fn reweigh(&mut self, factors: &[f64]) {
        for (weight, factor) in self.weights.iter_mut().zip(factors) {
            *weight *= factor;
        }
    }

    /// The factorised system.
    fn system(&self) -> Bordered {
        let mut system = Bordered::new(self.band, self.width, self.border);
        for group in &self.groups {
            system.absorb(group, self.weights[group.part]);
        }
        system.finish();
        system
    }

    /// The sum of squares of the weighted rows of each part after a step, by the linear prediction
    /// Jδ + r.
    pub fn squares_after(&self, step: &Solved) -> Vec<f64> {
        self.by_part(|group, weight| {
            let mut local = vec![0.0; group.columns];
            for (value, unknown) in local.iter_mut().zip(&group.band) {
                *value = unknown.map_or(0.0, |j| step.band[j]);
            }
            for share in &group.border {
                local[share.column as usize] += share.weight * step.border[share.unknown as usize];
            }
            local[group.columns - 1] = 1.0;
            let squares: f64 = (0..group.columns)
                .map(|i| {
                    let row = group.row(i).iter().zip(&local).skip(i);
                    row.map(|(r, x)| r * x).sum::<f64>().powi(2)
                })
                .sum();
            weight * weight * squares
        })
    }

    /// The trace of the hat matrix of each part: how many unknowns its rows use up.
    pub fn hat_traces(&self, covariance: &BorderedCovariance) -> Vec<f64> {
        self.by_part(|group, weight| covariance.hat_trace(group, weight))
    }

    fn by_part(&self, of: impl Fn(&Group, f64) -> f64 + Sync) -> Vec<f64> {
        let shares: Vec<f64> = self
            .groups
            .par_iter()
            .with_min_len(GROUPS_A_CORE)
            .map(|group| of(group, self.weights[group.part]))
            .collect();
        let mut sums = vec![0.0; self.weights.len()];
        for (group, share) in self.groups.iter().zip(shares) {
            sums[group.part] += share;
        }
        sums
    }
}
