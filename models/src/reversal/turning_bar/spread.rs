//! Covariance of the unknowns of a least-squares fit whose residuals are correlated.
//!
//! Least squares weighs all readings alike; under a covariance V of the readings its unknowns have
//! (JᵀJ)⁻¹ JᵀVJ (JᵀJ)⁻¹. JᵀVJ takes one pass: with S_i = Σ_{j<i} e^{−(t_i − t_j)/ℓ} row_j the sum over
//! all pairs is Σ (row_i row_iᵀ + row_i S_iᵀ + S_i row_iᵀ).

use nalgebra::{DMatrix, DVector};

use super::fit::TurningFit;
use crate::noise::Law;

/// Covariance of the unknowns, band before border, µm² and what follows from the units of each.
#[derive(Debug, Clone)]
pub struct Spread {
    covariance: DMatrix<f64>,
}

impl Spread {
    /// Under a law of the noise, all variances times `factor`.
    pub fn new(fit: &TurningFit, law: &Law, factor: f64) -> Self {
        let p = fit.inverse.nrows();
        let time = &fit.problem.run.time;
        let mut before = DVector::<f64>::zeros(p);
        let mut last = None;
        let mut pairs = DMatrix::<f64>::zeros(p, p);
        let mut own = DMatrix::<f64>::zeros(p, p);
        fit.problem.rows(&fit.at, |i, row| {
            let decay = last.map_or(0.0, |t: f64| (-(time[i] - t) / law.length).exp());
            before *= decay;
            for (j, a) in row {
                pairs.column_mut(*j).axpy(*a, &before, 1.0);
                for (k, b) in row {
                    own[(*j, *k)] += a * b;
                }
            }
            for (j, a) in row {
                before[*j] += a;
            }
            last = Some(time[i]);
        });
        let meat =
            own * (law.white + law.correlated) + (&pairs + pairs.transpose()) * law.correlated;
        Self {
            covariance: (&fit.inverse * meat * &fit.inverse) * factor,
        }
    }

    /// Variance of a combination of unknowns.
    pub fn variance(&self, weights: &DVector<f64>) -> f64 {
        weights.dot(&(&self.covariance * weights)).max(0.0)
    }

    /// Covariance of several combinations, one a column.
    pub fn of(&self, weights: &DMatrix<f64>) -> DMatrix<f64> {
        weights.tr_mul(&(&self.covariance * weights))
    }
}
