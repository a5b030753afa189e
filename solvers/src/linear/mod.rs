//! Linear least squares by orthogonal factorisation, by the shape of the matrix; and what an
//! iteration of a nonlinear method asks of its linear model.

pub mod banded;
pub mod bordered;
pub mod dense;
pub mod jacobi_svd;
pub mod limited;
pub mod pivoted_qr;
pub mod triangle;

use nalgebra::{DMatrix, DVector};

use crate::outcome::Combination;

/// A damped step and what the search for its damping needs to know of it.
#[derive(Debug, Clone)]
pub struct DampedStep {
    /// The step s(λ) = argmin ‖J s + r‖² + λ ‖D s‖², length n.
    pub step: DVector<f64>,
    /// qᵀ (JᵀJ + λD²)⁻¹ q with q = D²s / ‖D s‖: minus the derivative of ‖D s(λ)‖ over ‖D s‖.
    pub slope: f64,
}

/// The linear model r + J s of the residuals around a point, in factored form.
///
/// The minimiser and its methods only speak to this trait, so that a dense, a banded and a bordered
/// Jacobian ([`dense::DenseModel`], [`bordered::BorderedModel`]) are minimised by the same code.
///
/// A model may be under linear equality constraints and hold some parameters: then steps keep both.
pub trait LinearModel {
    /// Number of parameters, n.
    fn parameter_count(&self) -> usize;

    /// The gradient Jᵀ r, length n; under constraints that of the Lagrangian, zero at a minimum and
    /// for parameters held.
    fn gradient(&self) -> &DVector<f64>;

    /// The Euclidean norms of the columns of J, length n.
    fn column_norms(&self) -> &DVector<f64>;

    /// The numerical rank of J after its columns are scaled to unit length.
    fn rank(&self) -> usize;

    /// The undamped step; where J is rank deficient, one of the minimisers.
    fn undamped_step(&self) -> DVector<f64>;

    /// The damped step for λ > 0 and a positive diagonal D given as a vector, length n.
    fn damped_step(&self, damping: f64, scale: &DVector<f64>) -> DampedStep;

    /// ‖J s‖.
    fn image_norm(&self, step: &DVector<f64>) -> f64;

    /// A basis of the directions that change no residual, n × (n − rank): each column moves one
    /// dependent parameter and those that compensate it.
    fn null_space(&self) -> DMatrix<f64>;

    /// The combinations of parameters that the residuals do not determine, in words.
    fn undetermined(&self, names: &[String]) -> Vec<Combination> {
        self.null_space()
            .column_iter()
            .map(|column| {
                Combination::from_direction(&column.into_owned(), self.column_norms(), names)
            })
            .collect()
    }

    /// The direction of steepest descent in parameters scaled by D: −D⁻² g; under constraints the
    /// one among the steps that keep them.
    fn steepest_descent(&self, scale: &DVector<f64>) -> DVector<f64> {
        -self.gradient().component_div(scale).component_div(scale)
    }

    /// A simple direction along which the cost falls, in some of the parameters: that of the one with
    /// the steepest cost, moved alone. `None` where the cost does not fall.
    fn probe(&self, free: &[usize]) -> Option<DVector<f64>> {
        let (gradient, norms) = (self.gradient(), self.column_norms());
        let cosine = |j: usize| gradient[j].abs() / norms[j];
        let steepest = free
            .iter()
            .copied()
            .filter(|&j| norms[j] > 0.0)
            .max_by(|&i, &j| cosine(i).total_cmp(&cosine(j)))?;
        let mut direction = DVector::zeros(norms.len());
        direction[steepest] = if gradient[steepest] > 0.0 { -1.0 } else { 1.0 };
        Some(direction)
    }

    /// J v, length m; `None` where the factored form cannot give it.
    fn image(&self, _direction: &DVector<f64>) -> Option<DVector<f64>> {
        None
    }

    /// The step for other residuals than those the model was made with:
    /// argmin ‖J s + r‖² + λ ‖D s‖². `None` where the factored form cannot give it.
    fn step_for(
        &self,
        _residuals: &DVector<f64>,
        _damping: f64,
        _scale: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        None
    }

    /// The model in the parameters `free` alone, after the fixed ones have made `shift` (length
    /// n, zero at the free ones). `None` where the factored form cannot give it.
    fn restricted(&self, _free: &[usize], _shift: &DVector<f64>) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// The reduction of ½‖r‖² that the model promises for a step: −gᵀs − ½‖J s‖².
    fn predicted_reduction(&self, step: &DVector<f64>) -> f64 {
        -self.gradient().dot(step) - 0.5 * self.image_norm(step).powi(2)
    }
}
