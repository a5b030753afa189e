//! Rows under a robust loss.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::loss::Loss;

/// What a robust loss makes of a batch: the factors of its rows, its residuals, and the cost ½ Σ ρ.
pub struct Robust {
    pub rows: [f64; Tall::CAPACITY],
    pub residuals: [f64; Tall::CAPACITY],
    pub cost: f64,
}

impl Robust {
    /// Of weighted residuals, at most a batch.
    pub fn of(loss: Loss, far: bool, residuals: &[f64]) -> Self {
        let mut robust = Self {
            rows: [0.0; Tall::CAPACITY],
            residuals: [0.0; Tall::CAPACITY],
            cost: loss.cost(residuals),
        };
        for (i, r) in residuals.iter().enumerate() {
            let (row, residual) = if far {
                let root = loss.at(r * r).first.max(0.0).sqrt();
                (root, root)
            } else {
                loss.row_factors(*r)
            };
            robust.rows[i] = row;
            robust.residuals[i] = residual * r;
        }
        robust
    }

    /// Puts its residuals in the place of a batch's.
    pub fn replace_residuals(&self, batch: &mut Tall) {
        let (rows, last) = (batch.rows(), batch.columns() - 1);
        batch
            .column_mut(last)
            .copy_from_slice(&self.residuals[..rows]);
    }

    /// Multiplies the derivatives of a batch by the factors of its rows.
    pub fn scale_rows(&self, batch: &mut Tall) {
        for j in 0..batch.columns() - 1 {
            for (out, s) in batch.column_mut(j).iter_mut().zip(&self.rows) {
                *out *= s;
            }
        }
    }
}
