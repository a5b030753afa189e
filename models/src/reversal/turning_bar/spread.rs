//! Covariance of the unknowns of a least-squares fit whose residuals are correlated.
//!
//! Least squares weighs all readings alike; under a covariance V of the readings its unknowns have
//! (JᵀJ)⁻¹ JᵀVJ (JᵀJ)⁻¹. A level that scatters from turn to turn makes the slope of the form less sure and not the
//! eccentricity, and a wave the other way round. Neither the inverse nor the product is written out: a combination
//! w of unknowns has the variance vᵀ JᵀVJ v, v = (JᵀJ)⁻¹w, by one solve along the band.

use std::sync::Arc;

use errsep_solvers::linear::bordered::{BorderedCovariance, BorderedSymmetric};
use nalgebra::DVector;

use super::fit::TurningFit;
use super::meat::meat;
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
    /// (JᵀJ)⁻¹.
    covariance: Arc<BorderedCovariance>,
    /// JᵀVJ.
    meat: BorderedSymmetric,
}

impl Spread {
    /// Under a law of the noise and what is slower.
    pub fn new(fit: &TurningFit, law: &Law, slow: Slow) -> Self {
        Self {
            covariance: Arc::clone(&fit.covariance),
            meat: meat(fit, law, slow),
        }
    }

    /// Of readings without noise.
    pub(super) fn none(fit: &TurningFit) -> Self {
        Self::new(fit, &Law::of_white(0.0), Slow::default())
    }

    /// Variance of a combination of unknowns.
    pub fn variance(&self, weights: &DVector<f64>) -> f64 {
        self.meat.form(&self.taken(weights.as_slice())).max(0.0)
    }

    /// What each unknown has in common with a combination of them.
    pub(super) fn times(&self, weights: &[f64]) -> Vec<f64> {
        self.taken(&self.meat.times(&self.taken(weights)))
    }

    /// JᵀVJ times a vector over the unknowns.
    pub(super) fn meat_times(&self, vector: &[f64]) -> Vec<f64> {
        self.meat.times(vector)
    }

    /// (JᵀJ)⁻¹ times a vector over the unknowns.
    fn taken(&self, weights: &[f64]) -> Vec<f64> {
        let sparse = |part: &[f64]| -> Vec<(usize, f64)> {
            let weights = part.iter().copied().enumerate();
            weights.filter(|(_, w)| *w != 0.0).collect()
        };
        let (band, border) = weights.split_at(self.meat.band_len());
        let (mut taken, border) = self.covariance.times(&sparse(band), &sparse(border));
        taken.extend(border);
        taken
    }
}
