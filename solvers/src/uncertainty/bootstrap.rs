//! The residual bootstrap.
//!
//! Each replicate adds to the fitted values errors drawn with replacement from the residuals,
//! centred and widened by √(m/ν) for the degrees of freedom the fit has used (Davison & Hinkley
//! 1997, 6.3), and fits again. The errors are taken as alike, whatever their distribution: whiten
//! residuals of unequal uncertainty first.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::fit::fit;
use crate::options::Options;
use crate::outcome::{Fit, FitError};
use crate::problem::{NoValue, Problem};

/// Refitted parameters.
#[derive(Debug, Clone)]
pub struct Bootstrap {
    /// One row a replicate that reached a minimum, replicates × n, in the order of their numbers.
    pub samples: DMatrix<f64>,
    /// The standard uncertainties that each of these fits gives itself, replicates × n.
    pub uncertainties: DMatrix<f64>,
    /// The fitted parameters around which it was drawn, length n.
    pub estimate: DVector<f64>,
    /// Their standard uncertainties from the covariance, length n.
    pub estimate_uncertainty: DVector<f64>,
    /// Replicates that did not: the intervals are conditional on reaching one.
    pub failed: usize,
}

/// Refits `replicates` times around a fit made with the same problem and options.
///
/// Replicate k draws from stream k of the seed: the samples do not depend on the number of
/// threads.
///
/// # Errors
/// [`FitError::Setting`] without replicates or without degrees of freedom.
pub fn bootstrap<P: Problem + Sync + ?Sized>(
    problem: &P,
    fitted: &Fit,
    replicates: usize,
    seed: u64,
    options: &Options,
) -> Result<Bootstrap, FitError> {
    let freedom = fitted.degrees_of_freedom();
    if replicates == 0 || freedom == 0 {
        return Err(FitError::Setting {
            setting: "replicates",
            value: format!("{replicates} with {freedom} degrees of freedom"),
            must: "positive, both",
        });
    }
    let errors = widened(&fitted.residuals, freedom);
    let own = scaled_uncertainties(fitted);
    let rows: Vec<Option<(DVector<f64>, DVector<f64>)>> = (0..replicates)
        .into_par_iter()
        .map(|replicate| {
            let mut generator = ChaCha8Rng::seed_from_u64(seed);
            generator.set_stream(replicate as u64);
            let shift = DVector::from_fn(errors.len(), |i, _| {
                -fitted.residuals[i] - errors[generator.random_range(0..errors.len())]
            });
            let shifted = Shifted { problem, shift };
            fit(&shifted, fitted.parameters.clone(), options)
                .ok()
                .filter(|f| f.ending.is_converged())
                .map(|f| {
                    let uncertainties = scaled_uncertainties(&f);
                    (f.parameters, uncertainties)
                })
        })
        .collect();
    let kept: Vec<(DVector<f64>, DVector<f64>)> = rows.into_iter().flatten().collect();
    let n = fitted.parameters.len();
    Ok(Bootstrap {
        samples: DMatrix::from_fn(kept.len(), n, |i, j| kept[i].0[j]),
        uncertainties: DMatrix::from_fn(kept.len(), n, |i, j| kept[i].1[j]),
        estimate: fitted.parameters.clone(),
        estimate_uncertainty: own,
        failed: replicates - kept.len(),
    })
}

/// Standard uncertainties scaled by the residuals; there are degrees of freedom here.
fn scaled_uncertainties(fit: &Fit) -> DVector<f64> {
    let covariance = fit.covariance();
    let scale = covariance.residual_variance.unwrap_or(0.0).sqrt();
    covariance.standard_uncertainties() * scale
}

fn widened(residuals: &DVector<f64>, freedom: usize) -> Vec<f64> {
    let mean = residuals.mean();
    let factor = (residuals.len() as f64 / freedom as f64).sqrt();
    residuals.iter().map(|r| (r - mean) * factor).collect()
}

/// The problem with other observations: residuals plus a constant vector.
struct Shifted<'a, P: ?Sized> {
    problem: &'a P,
    shift: DVector<f64>,
}

impl<P: Problem + ?Sized> Problem for Shifted<'_, P> {
    fn parameter_count(&self) -> usize {
        self.problem.parameter_count()
    }

    fn residual_count(&self) -> usize {
        self.problem.residual_count()
    }

    fn residuals(&self, parameters: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let residuals = self.problem.residuals(parameters)?;
        if residuals.len() != self.shift.len() {
            return Err(NoValue::new(
                "the number of residuals changes with the parameters",
            ));
        }
        Ok(residuals + &self.shift)
    }

    fn jacobian(&self, parameters: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        self.problem.jacobian(parameters)
    }

    fn parameter_name(&self, index: usize) -> String {
        self.problem.parameter_name(index)
    }
}

impl Bootstrap {
    /// The standard deviation of a parameter over the replicates; `None` with fewer than two, or
    /// without such a parameter.
    pub fn standard_uncertainty(&self, index: usize) -> Option<f64> {
        if self.samples.nrows() < 2 || index >= self.samples.ncols() {
            return None;
        }
        let column = self.samples.column(index);
        let mean = column.mean();
        let squares: f64 = column.iter().map(|v| (v - mean).powi(2)).sum();
        Some((squares / (self.samples.nrows() - 1) as f64).sqrt())
    }

    /// The studentised interval of a parameter at a confidence `level` between 0 and 1, from the
    /// quantiles of (p* − p)/u*: right to second order (Davison & Hinkley 1997, 5.2.1), the one to
    /// take. `None` with fewer than two replicates, or without such a parameter determined.
    pub fn studentised_interval(&self, index: usize, level: f64) -> Option<(f64, f64)> {
        if self.samples.nrows() < 2 || index >= self.samples.ncols() {
            return None;
        }
        let (p, u) = (self.estimate[index], self.estimate_uncertainty[index]);
        let mut scores: Vec<f64> = self
            .samples
            .column(index)
            .iter()
            .zip(self.uncertainties.column(index).iter())
            .map(|(sample, own)| (sample - p) / own)
            .collect();
        if !u.is_finite() || scores.iter().any(|score| !score.is_finite()) {
            return None;
        }
        scores.sort_by(f64::total_cmp);
        let tail = 0.5 * (1.0 - level.clamp(0.0, 1.0));
        Some((
            p - u * quantile(&scores, 1.0 - tail),
            p - u * quantile(&scores, tail),
        ))
    }

    /// The percentile interval of a parameter at a confidence `level` between 0 and 1: simpler,
    /// and too short where residuals are few. `None` with fewer than two replicates, or without
    /// such a parameter.
    pub fn percentile_interval(&self, index: usize, level: f64) -> Option<(f64, f64)> {
        if self.samples.nrows() < 2 || index >= self.samples.ncols() {
            return None;
        }
        let mut sorted: Vec<f64> = self.samples.column(index).iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        let tail = 0.5 * (1.0 - level.clamp(0.0, 1.0));
        Some((quantile(&sorted, tail), quantile(&sorted, 1.0 - tail)))
    }
}

/// The quantile of sorted samples at (N + 1) p, which covers p exactly for exchangeable draws.
fn quantile(sorted: &[f64], probability: f64) -> f64 {
    let last = sorted.len() - 1;
    let place = ((sorted.len() + 1) as f64 * probability - 1.0).clamp(0.0, last as f64);
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}
