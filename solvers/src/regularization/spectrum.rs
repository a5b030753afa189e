//! The solutions of one decomposed problem for one set of data.

use nalgebra::DVector;

use super::error::checked_lambda;
use super::{Decomposition, Family, Point, RegularizationError, Uncertainty};

/// A decomposed problem with its data: the solution at any λ, or truncated after k components.
#[derive(Debug, Clone)]
pub struct Spectrum<'a> {
    decomposition: &'a Decomposition,
    /// Uᵀb.
    coefficients: DVector<f64>,
    /// The part of b that no x reaches.
    unreachable: DVector<f64>,
    /// W(AW)⁺b.
    free_solution: Option<DVector<f64>>,
}

impl<'a> Spectrum<'a> {
    pub(super) fn new(
        decomposition: &'a Decomposition,
        data: &DVector<f64>,
    ) -> Result<Self, RegularizationError> {
        if data.len() != decomposition.row_count() {
            return Err(RegularizationError::Shape {
                what: "the right-hand side",
                expected: decomposition.row_count(),
                found: data.len(),
            });
        }
        if data.iter().any(|value| !value.is_finite()) {
            return Err(RegularizationError::NotFinite {
                what: "the right-hand side",
            });
        }
        let mut unreachable = data.clone();
        let free_solution = decomposition.free.as_ref().map(|free| {
            unreachable -= &free.range * (free.range.transpose() * data);
            &free.solve * data
        });
        let coefficients = decomposition.left.transpose() * &unreachable;
        unreachable -= &decomposition.left * &coefficients;
        Ok(Self {
            decomposition,
            coefficients,
            unreachable,
            free_solution,
        })
    }

    /// Uᵀb, the coefficients whose decay against γ the discrete Picard condition asks for.
    pub fn coefficients(&self) -> &DVector<f64> {
        &self.coefficients
    }

    /// The filter factors γ²/(γ² + λ²).
    ///
    /// # Errors
    /// λ is not positive.
    pub fn filter_factors(&self, lambda: f64) -> Result<DVector<f64>, RegularizationError> {
        let square = checked_lambda(lambda)?.powi(2);
        Ok(self
            .decomposition
            .singular_values
            .map(|gamma| gamma * gamma / (gamma * gamma + square)))
    }

    /// The Tikhonov solution at λ, length n.
    ///
    /// # Errors
    /// λ is not positive.
    pub fn solution(&self, lambda: f64) -> Result<DVector<f64>, RegularizationError> {
        Ok(self.assemble(&self.components(lambda)?))
    }

    /// The residuals b − Ax at λ, length m.
    ///
    /// # Errors
    /// λ is not positive.
    pub fn residuals(&self, lambda: f64) -> Result<DVector<f64>, RegularizationError> {
        let kept = self.filter_factors(lambda)?.map(|factor| 1.0 - factor);
        Ok(&self.unreachable + &self.decomposition.left * kept.component_mul(&self.coefficients))
    }

    /// The solution from the `kept` largest γ alone (truncated singular value decomposition; with a
    /// penalty its generalized form). At most the numerical rank is kept.
    pub fn truncated(&self, kept: usize) -> DVector<f64> {
        let kept = kept.min(self.decomposition.rank());
        let components = DVector::from_fn(self.coefficients.len(), |index, _| {
            if index < kept {
                self.coefficients[index] / self.decomposition.singular_values[index]
            } else {
                0.0
            }
        });
        self.assemble(&components)
    }

    /// Residual norm and seminorm after truncation to `kept` components.
    pub fn truncated_norms(&self, kept: usize) -> (f64, f64) {
        let kept = kept.min(self.decomposition.rank());
        let mut residual = self.unreachable.norm_squared();
        let mut seminorm = 0.0;
        for (index, beta) in self.coefficients.iter().enumerate() {
            if index < kept {
                seminorm += (beta / self.decomposition.singular_values[index]).powi(2);
            } else {
                residual += beta * beta;
            }
        }
        (residual.sqrt(), seminorm.sqrt())
    }

    /// Covariance and bias of the solution at λ, for white noise of standard deviation `noise` in b.
    ///
    /// # Errors
    /// λ is not positive.
    pub fn uncertainty(&self, lambda: f64, noise: f64) -> Result<Uncertainty, RegularizationError> {
        let square = checked_lambda(lambda)?.powi(2);
        let decomposition = self.decomposition;
        let mut spread = decomposition.directions.clone();
        let mut pull = decomposition.directions.clone();
        for (index, gamma) in decomposition.singular_values.iter().enumerate() {
            let norm = gamma * gamma + square;
            spread.column_mut(index).scale_mut(gamma / norm);
            pull.column_mut(index).scale_mut(square / norm);
        }
        let mut covariance = &spread * spread.transpose();
        if let Some(free) = &decomposition.free {
            covariance += &free.solve * free.solve.transpose();
        }
        covariance *= noise * noise;
        Ok(Uncertainty {
            covariance,
            bias_estimate: -(&pull * self.components(lambda)?),
            pull,
        })
    }

    fn components(&self, lambda: f64) -> Result<DVector<f64>, RegularizationError> {
        let square = checked_lambda(lambda)?.powi(2);
        Ok(self
            .decomposition
            .singular_values
            .zip_map(&self.coefficients, |gamma, beta| {
                gamma * beta / (gamma * gamma + square)
            }))
    }

    fn assemble(&self, components: &DVector<f64>) -> DVector<f64> {
        let penalised = &self.decomposition.directions * components;
        match &self.free_solution {
            Some(free) => penalised + free,
            None => penalised,
        }
    }
}

impl Family for Spectrum<'_> {
    fn row_count(&self) -> usize {
        self.decomposition.row_count()
    }

    /// From a tenth of γₖ, where the last component is let through whole, but no less than rounding
    /// error, to γ₁.
    fn range(&self) -> (f64, f64) {
        let values = &self.decomposition.singular_values;
        let largest = values.iter().copied().fold(0.0, f64::max);
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        ((0.1 * smallest).max(largest * 16.0 * f64::EPSILON), largest)
    }

    fn point(&self, lambda: f64) -> Result<Point, RegularizationError> {
        let square = checked_lambda(lambda)?.powi(2);
        let mut residual = self.unreachable.norm_squared();
        let mut seminorm = 0.0;
        let mut slope = 0.0;
        let mut trace = self
            .decomposition
            .free
            .as_ref()
            .map_or(0.0, |free| free.range.ncols() as f64);
        for (gamma, beta) in self
            .decomposition
            .singular_values
            .iter()
            .zip(self.coefficients.iter())
        {
            let norm = gamma * gamma + square;
            let passed = gamma * gamma / norm;
            let stopped = square / norm;
            let component = (gamma * beta / norm).powi(2);
            residual += (stopped * beta).powi(2);
            seminorm += component;
            slope -= 4.0 / lambda * stopped * component;
            trace += passed;
        }
        Ok(Point {
            lambda,
            residual_norm: residual.sqrt(),
            seminorm: seminorm.sqrt(),
            seminorm_sq_slope: slope,
            effective_parameters: trace,
        })
    }
}
