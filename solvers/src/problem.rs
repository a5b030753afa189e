//! What a solver needs to know of a least-squares problem.

use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// Why a model has no value at some parameters: the solver takes a shorter step instead.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the model has no value here: {reason}")]
pub struct NoValue {
    /// What is wrong with the parameters, in the words of the model.
    pub reason: String,
}

impl NoValue {
    /// A refusal with its reason.
    pub fn new(reason: impl Into<String>) -> Self {
        Self {
            reason: reason.into(),
        }
    }
}

/// A nonlinear least-squares problem: minimise ½ Σ rᵢ(p)², r = (model − observation) / σ.
///
/// Residuals are expected in units of their standard deviation where that is known; then the
/// covariance of the parameters is (JᵀJ)⁻¹, otherwise it is scaled by the residual variance.
pub trait Problem {
    /// Number of parameters, n.
    fn parameter_count(&self) -> usize;

    /// Number of residuals, m.
    fn residual_count(&self) -> usize;

    /// The residuals r(p), length m.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined; a solver then shortens its step.
    fn residuals(&self, parameters: &DVector<f64>) -> Result<DVector<f64>, NoValue>;

    /// The Jacobian J = ∂r/∂p, m × n.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    fn jacobian(&self, parameters: &DVector<f64>) -> Result<DMatrix<f64>, NoValue>;

    /// The name of a parameter, for messages and tables.
    fn parameter_name(&self, index: usize) -> String {
        format!("p{index}")
    }
}

/// A reference to a problem is that problem, so that a fit can be compiled once for all of them.
impl<P: Problem + ?Sized> Problem for &P {
    fn parameter_count(&self) -> usize {
        (**self).parameter_count()
    }

    fn residual_count(&self) -> usize {
        (**self).residual_count()
    }

    fn residuals(&self, parameters: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        (**self).residuals(parameters)
    }

    fn jacobian(&self, parameters: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        (**self).jacobian(parameters)
    }

    fn parameter_name(&self, index: usize) -> String {
        (**self).parameter_name(index)
    }
}
