//! The covariance of fitted parameters, with what it does not cover.
//!
//! For residuals r = (model − observation) / σ the covariance is (JᵀJ)⁻¹ to first order, taken
//! from the triangle of the QR and never from the product JᵀJ. Where σ is not known the residuals
//! themselves estimate it: s² = Σ r² / ν (GUM 5.1, JCGM 100; Seber & Wild 1989, 5.1).

use nalgebra::{DMatrix, DVector};

use crate::bounds::ActiveBound;
use crate::loss::Loss;
use crate::outcome::{Combination, Fit};

/// Covariance of the parameters, in the parameters' own order and units.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// n × n. A parameter held by a bound has zero row and column. Where rank is lacking the
    /// matrix is that of the gauge in which the parameters `held` do not move.
    pub matrix: DMatrix<f64>,
    /// The parameters' names, length n.
    pub names: Vec<String>,
    /// ν: residuals less determined parameters.
    pub degrees_of_freedom: usize,
    /// s² = Σ r² / ν, or its robust counterpart; `None` when ν = 0.
    pub residual_variance: Option<f64>,
    /// The combinations of parameters that no residual depends on.
    pub undetermined: Vec<Combination>,
    /// The parameters that were taken as not moving, to fix the gauge: one a combination.
    pub held: Vec<usize>,
    /// The bounds that hold a parameter: its uncertainty is not that of a free fit.
    pub active_bounds: Vec<ActiveBound>,
    /// For each parameter whether some undetermined combination moves it.
    loose: Vec<bool>,
    /// The matrix and the residual variance for residuals counted in a unit in which neither leaves
    /// the range of numbers.
    counted: (DMatrix<f64>, Option<f64>),
}

impl Covariance {
    /// For residuals in units of their standard deviation.
    pub(crate) fn of(fit: &Fit) -> Self {
        let n = fit.parameters.len();
        let free = free_parameters(fit);
        let triangle = &fit.triangle;
        let inverse = triangle.inverse_gram();
        let null = triangle.null_space();

        let mut matrix = DMatrix::zeros(n, n);
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                matrix[(i, j)] = inverse[(a, b)];
            }
        }
        let free_names: Vec<String> = free.iter().map(|&j| fit.names[j].clone()).collect();
        let undetermined: Vec<Combination> = null
            .column_iter()
            .map(|c| Combination::from_direction(&c.into_owned(), triangle.units(), &free_names))
            .collect();
        let loose = fit
            .names
            .iter()
            .map(|name| {
                undetermined
                    .iter()
                    .any(|c| c.terms.iter().any(|(term, _)| term == name))
            })
            .collect();
        let held = triangle.dependent().iter().map(|&a| free[a]).collect();
        let degrees_of_freedom = fit.degrees_of_freedom();
        let matrix = matrix * robust_factor(fit);
        let variance = residual_variance(fit);
        Self {
            matrix: &matrix / fit.unit / fit.unit,
            names: fit.names.clone(),
            degrees_of_freedom,
            residual_variance: variance.map(|v| v * fit.unit * fit.unit),
            undetermined,
            held,
            active_bounds: fit.active_bounds.clone(),
            loose,
            counted: (matrix, variance),
        }
    }

    /// The covariance for residuals whose common standard deviation is unknown: multiplied by the
    /// residual variance. `None` without degrees of freedom to estimate that from.
    pub fn scaled_by_residuals(&self) -> Option<Self> {
        let (matrix, variance) = &self.counted;
        Some(Self {
            matrix: matrix * (*variance)?,
            ..self.clone()
        })
    }

    /// Standard uncertainties, length n: infinite for a parameter that is not determined, zero
    /// for one held by a bound.
    pub fn standard_uncertainties(&self) -> DVector<f64> {
        DVector::from_fn(self.names.len(), |j, _| self.standard_uncertainty(j))
    }

    /// The standard uncertainty of parameter `index`; infinite where it is not determined or
    /// there is no such parameter.
    pub fn standard_uncertainty(&self, index: usize) -> f64 {
        match self.loose.get(index) {
            Some(false) => self.matrix[(index, index)].max(0.0).sqrt(),
            _ => f64::INFINITY,
        }
    }

    /// Whether the data determine parameter `index`.
    pub fn is_determined(&self, index: usize) -> bool {
        self.loose.get(index) == Some(&false)
    }

    /// The correlation of two parameters; `None` where either is held or not determined.
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        if !self.is_determined(i) || !self.is_determined(j) {
            return None;
        }
        let product = self.matrix[(i, i)] * self.matrix[(j, j)];
        (product > 0.0).then(|| (self.matrix[(i, j)] / product.sqrt()).clamp(-1.0, 1.0))
    }
}

fn free_parameters(fit: &Fit) -> Vec<usize> {
    (0..fit.parameters.len())
        .filter(|&j| fit.active_bounds.iter().all(|b| b.index != j))
        .collect()
}

/// The residuals in the unit of the fit, and the loss for them.
fn counted(fit: &Fit) -> (DVector<f64>, Loss) {
    (&fit.residuals / fit.unit, fit.loss.in_unit(fit.unit))
}

/// ψ = ρ′ r and its derivative ρ′ + 2sρ″, averaged as Huber's covariance needs them.
fn influence(fit: &Fit) -> (f64, f64, f64) {
    let m = fit.residuals.len() as f64;
    let mut squares = 0.0;
    let mut slopes = 0.0;
    let mut slope_squares = 0.0;
    let (residuals, loss) = counted(fit);
    for r in residuals.iter() {
        let s = r * r;
        let at = loss.at(s);
        let slope = at.first + 2.0 * s * at.second;
        squares += (at.first * r).powi(2);
        slopes += slope;
        slope_squares += slope * slope;
    }
    let mean = slopes / m;
    (squares, mean, (slope_squares / m - mean * mean).max(0.0))
}

/// Σ r² / ν, or for a robust loss Huber's K² Σψ² / ν / (mean ψ′)² with
/// K = 1 + (n/m) var ψ′ / (mean ψ′)² (Huber 1981, 7.6).
fn residual_variance(fit: &Fit) -> Option<f64> {
    let freedom = fit.degrees_of_freedom();
    if freedom == 0 {
        return None;
    }
    if fit.loss.scale().is_none() {
        return Some(counted(fit).0.norm_squared() / freedom as f64);
    }
    let (squares, mean, variance) = influence(fit);
    let share = fit.triangle.rank() as f64 / fit.residuals.len() as f64;
    let correction = 1.0 + share * variance / (mean * mean);
    Some((correction / mean).powi(2) * squares / freedom as f64 / robust_factor(fit))
}

/// How much less a robust fit determines than least squares would with residuals of unit
/// deviation: 1 for ordinary least squares, else 1/mean ψ′.
fn robust_factor(fit: &Fit) -> f64 {
    if fit.loss.scale().is_none() {
        return 1.0;
    }
    let (_, mean, _) = influence(fit);
    if mean > 0.0 {
        1.0 / mean
    } else {
        f64::INFINITY
    }
}
