//! Covariance of the unknowns of a least-squares fit whose residuals are correlated.
//!
//! Least squares weighs all readings alike; under a covariance V of the readings its unknowns have
//! (JᵀJ)⁻¹ JᵀVJ (JᵀJ)⁻¹. JᵀVJ takes one pass: with S_i = Σ_{j<i} e^{−(t_i − t_j)/ℓ} row_j the sum over
//! all pairs is Σ (row_i row_iᵀ + row_i S_iᵀ + S_i row_iᵀ). What levels and waves of single turns scatter beyond
//! the law is a further part of V: of each turn Σ row_i, Σ row_i cos ψ_i and Σ row_i sin ψ_i, squared. So a level
//! makes the slope of the form less sure and not the eccentricity, and a wave the other way round.

use nalgebra::{DMatrix, DVector};

use super::fit::TurningFit;
use super::noise::windows;
use crate::noise::Law;

/// What is slow in the residuals and not in the law: variances from turn to turn, µm².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slow {
    /// Of the level.
    pub level: f64,
    /// Of either amplitude of the once-per-turn wave.
    pub wave: f64,
}

/// Covariance of the unknowns, band before border, µm² and what follows from the units of each.
#[derive(Debug, Clone)]
pub struct Spread {
    covariance: DMatrix<f64>,
}

impl Spread {
    /// Under a law of the noise and what is slower.
    pub fn new(fit: &TurningFit, law: &Law, slow: Slow) -> Self {
        let p = fit.inverse.nrows();
        let time = &fit.problem.run.time;
        let mut before = DVector::<f64>::zeros(p);
        let mut last = None;
        let mut pairs = DMatrix::<f64>::zeros(p, p);
        let mut own = DMatrix::<f64>::zeros(p, p);
        let ends = windows(&fit.psi, 1.0).into_iter().map(|turn| turn.end - 1);
        let mut ends = ends.peekable();
        let mut turn = DMatrix::<f64>::zeros(p, 3);
        let mut slowly = DMatrix::<f64>::zeros(p, p);
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
            let (sin, cos) = fit.psi[i].sin_cos();
            for (j, a) in row {
                for (k, wave) in [1.0, cos, sin].into_iter().enumerate() {
                    turn[(*j, k)] += a * wave;
                }
            }
            if ends.next_if_eq(&i).is_some() {
                for (k, variance) in [slow.level, slow.wave, slow.wave].into_iter().enumerate() {
                    slowly.syger(variance, &turn.column(k), &turn.column(k), 1.0);
                }
                turn.fill(0.0);
            }
        });
        slowly.fill_upper_triangle_with_lower_triangle();
        let meat = own * (law.white + law.correlated)
            + (&pairs + pairs.transpose()) * law.correlated
            + slowly;
        Self {
            covariance: &fit.inverse * meat * &fit.inverse,
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
