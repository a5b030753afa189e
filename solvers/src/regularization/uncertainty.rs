//! How sure a regularized solution is: what noise does to it, and what the penalty does.

use nalgebra::{DMatrix, DVector};

/// Covariance and bias of a regularized solution, kept apart.
///
/// With A# the regularized inverse, x_λ − x = A#·noise + (A#A − I)x. The first term has the
/// covariance below. The second is not random: it depends on the truth, and is bounded by
/// [`bias_bound`](Self::bias_bound). Adding the estimated bias to the variance, or leaving it out of the
/// statement, would both be a claim that the data do not support.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// Covariance of the estimate around its own expectation, n × n.
    pub covariance: DMatrix<f64>,
    /// (A#A − I)x_λ: the bias if the truth were the estimate. Too small where the penalty removed
    /// most of the signal, because x_λ no longer holds what was removed.
    pub bias_estimate: DVector<f64>,
    /// B with bias = −B·z and ‖z‖ = ‖Lx‖ of the truth, n × k: the norm of a row times ‖Lx‖ bounds
    /// the bias of that unknown, and wᵀB that of any combination wᵀx.
    pub pull: DMatrix<f64>,
}

impl Uncertainty {
    /// Standard deviations of the estimate, bias not included.
    pub fn standard_deviations(&self) -> DVector<f64> {
        self.covariance
            .diagonal()
            .map(|variance| variance.max(0.0).sqrt())
    }

    /// Bound of the bias of each unknown when ‖Lx‖ of the truth is at most `seminorm`.
    pub fn bias_bound(&self, seminorm: f64) -> DVector<f64> {
        DVector::from_iterator(
            self.pull.nrows(),
            self.pull.row_iter().map(|row| row.norm() * seminorm),
        )
    }
}
