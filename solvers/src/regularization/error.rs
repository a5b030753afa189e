//! What can be wrong with a regularized problem.

use thiserror::Error;

/// Why a regularized problem has no answer.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RegularizationError {
    /// Two sizes that must agree do not.
    #[error("{what} has {found} entries where {expected} are needed")]
    Shape {
        /// What has the wrong size.
        what: &'static str,
        /// The size that is needed.
        expected: usize,
        /// The size that was given.
        found: usize,
    },
    /// A matrix or a right-hand side holds an infinite or missing value.
    #[error("{what} holds a value that is not finite; remove or repair that row")]
    NotFinite {
        /// What holds it.
        what: &'static str,
    },
    /// Matrix and penalty leave the same directions free.
    #[error(
        "neither the data nor the penalty determine {dimension} combination(s) of the unknowns; \
         add a constraint or penalise them"
    )]
    SharedNullSpace {
        /// How many.
        dimension: usize,
    },
    /// λ is zero, negative or not finite where it must be positive.
    #[error("the regularization parameter must be positive and finite, not {lambda}")]
    Lambda {
        /// The value given.
        lambda: f64,
    },
    /// The data are zero, or the penalty acts on nothing: every λ gives the same answer.
    #[error(
        "the data do not respond to the penalised unknowns: every regularization parameter gives the same answer"
    )]
    NothingToChoose,
    /// The singular value decomposition did not converge.
    #[error("the singular value decomposition did not converge")]
    DidNotConverge,
}

/// λ as a method of this module takes it.
pub(super) fn checked_lambda(lambda: f64) -> Result<f64, RegularizationError> {
    if lambda.is_finite() && lambda > 0.0 {
        Ok(lambda)
    } else {
        Err(RegularizationError::Lambda { lambda })
    }
}
