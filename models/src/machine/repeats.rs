//! Repeats of a component that differ as a whole.
//!
//! An instrument that is zeroed anew before each repeat, or that drifts, gives all readings of a repeat something
//! in common. What is independent is then the repeat.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::Observation;

/// Below this probability repeats count as different.
const LEVEL: f64 = 0.01;

/// The readings of each repeat about the function that all have in common.
pub(super) struct Repeats {
    /// Of each repeat its rows of the design and what the function leaves of its readings.
    parts: Vec<(DMatrix<f64>, DVector<f64>)>,
}

impl Repeats {
    /// None with one repeat.
    pub fn of(
        observations: &[Observation],
        design: &DMatrix<f64>,
        left: &DVector<f64>,
    ) -> Option<Self> {
        let mut rows: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (row, observation) in observations.iter().enumerate() {
            rows.entry(observation.repeat).or_default().push(row);
        }
        (rows.len() > 1).then(|| Self {
            parts: rows
                .values()
                .map(|rows| (design.select_rows(rows), left.select_rows(rows)))
                .collect(),
        })
    }

    /// How many there are.
    pub fn count(&self) -> f64 {
        self.parts.len() as f64
    }

    /// Whether functions of their own leave less of the repeats than noise lets them (F test). Readings that
    /// their own functions leave nothing of differ if the common one does.
    pub fn differ(&self) -> bool {
        let terms = self.parts.first().map_or(0, |(design, _)| design.ncols());
        let (mut common, mut own, mut rank, mut readings) = (0.0, 0.0, 0, 0);
        for (design, left) in &self.parts {
            let parts = design.clone().svd(true, false);
            let greatest = parts.singular_values.max();
            let Some(u) = &parts.u else { return false };
            let along: f64 = u
                .column_iter()
                .zip(parts.singular_values.iter())
                .filter(|(_, value)| **value > 1e-9 * greatest)
                .map(|(column, _)| {
                    rank += 1;
                    column.dot(left).powi(2)
                })
                .sum();
            common += left.norm_squared();
            own += (left.norm_squared() - along).max(0.0);
            readings += left.len();
        }
        let (between, within) = (rank - terms.min(rank), readings - rank);
        if between == 0 || within == 0 {
            return false;
        }
        let f = (common - own) / between as f64 / (own / within as f64);
        let law = FisherSnedecor::new(between as f64, within as f64);
        // Equal to the last digit: 0/0.
        !f.is_nan() && (f == f64::INFINITY || law.is_ok_and(|law| law.sf(f.max(0.0)) < LEVEL))
    }

    /// Covariance of the coefficients with the repeats as what is independent,
    /// `(X'X)⁻¹ Σ X_r'e_r e_r'X_r (X'X)⁻¹ R/(R − 1)`: of R repeats over the same positions the covariance of their
    /// own coefficients over R.
    pub fn covariance(&self, inverse: &DMatrix<f64>) -> DMatrix<f64> {
        let mut middle = DMatrix::zeros(inverse.nrows(), inverse.ncols());
        for (design, left) in &self.parts {
            let of_repeat = design.tr_mul(left);
            middle += &of_repeat * of_repeat.transpose();
        }
        inverse * middle * inverse * (self.count() / (self.count() - 1.0))
    }
}
