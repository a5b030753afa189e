//! Problems that are linear in some of their parameters: model = Φ(α) c.

use nalgebra::{DMatrix, DVector};

use crate::problem::{NoValue, Problem};

/// A least-squares problem min ½ ‖Φ(α) c − y‖² with nonlinear parameters α and linear ones c.
///
/// Rows are in units of the standard deviation of their observation where that is known.
pub trait SeparableProblem {
    /// Number of nonlinear parameters, k.
    fn nonlinear_count(&self) -> usize;

    /// Number of linear parameters, n.
    fn linear_count(&self) -> usize;

    /// The observations y, length m.
    fn observations(&self) -> &DVector<f64>;

    /// The basis functions Φ(α), m × n.
    ///
    /// # Errors
    /// [`NoValue`] where they are not defined; a solver then shortens its step.
    fn basis(&self, nonlinear: &DVector<f64>) -> Result<DMatrix<f64>, NoValue>;

    /// The derivative ∂Φ/∂α of the basis by one nonlinear parameter, m × n.
    ///
    /// # Errors
    /// [`NoValue`] where it is not defined.
    fn basis_derivative(
        &self,
        nonlinear: &DVector<f64>,
        index: usize,
    ) -> Result<DMatrix<f64>, NoValue>;

    /// The name of a nonlinear parameter.
    fn nonlinear_name(&self, index: usize) -> String {
        format!("alpha{index}")
    }

    /// The name of a linear parameter.
    fn linear_name(&self, index: usize) -> String {
        format!("c{index}")
    }
}

/// A separable problem as an ordinary one in all parameters, (α, c).
#[derive(Debug, Clone, Copy)]
pub struct Joint<'a, P: ?Sized>(pub &'a P);

impl<P: SeparableProblem + ?Sized> Joint<'_, P> {
    fn split(&self, parameters: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        let k = self.0.nonlinear_count();
        let n = self.0.linear_count();
        let entry = |i: usize| parameters.get(i).copied().unwrap_or(f64::NAN);
        (
            DVector::from_fn(k, |i, _| entry(i)),
            DVector::from_fn(n, |i, _| entry(k + i)),
        )
    }
}

impl<P: SeparableProblem + ?Sized> Problem for Joint<'_, P> {
    fn parameter_count(&self) -> usize {
        self.0.nonlinear_count() + self.0.linear_count()
    }

    fn residual_count(&self) -> usize {
        self.0.observations().len()
    }

    fn residuals(&self, parameters: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let (nonlinear, linear) = self.split(parameters);
        let basis = checked(self.0, self.0.basis(&nonlinear)?)?;
        Ok(basis * linear - self.0.observations())
    }

    fn jacobian(&self, parameters: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let (nonlinear, linear) = self.split(parameters);
        let k = self.0.nonlinear_count();
        let mut jacobian = DMatrix::zeros(self.residual_count(), self.parameter_count());
        for j in 0..k {
            let derivative = checked(self.0, self.0.basis_derivative(&nonlinear, j)?)?;
            jacobian.set_column(j, &(derivative * &linear));
        }
        let basis = checked(self.0, self.0.basis(&nonlinear)?)?;
        jacobian.columns_mut(k, linear.len()).copy_from(&basis);
        Ok(jacobian)
    }

    fn parameter_name(&self, index: usize) -> String {
        match index.checked_sub(self.0.nonlinear_count()) {
            Some(linear) => self.0.linear_name(linear),
            None => self.0.nonlinear_name(index),
        }
    }
}

/// The matrix if it is m × n and finite.
pub(crate) fn checked<P: SeparableProblem + ?Sized>(
    problem: &P,
    matrix: DMatrix<f64>,
) -> Result<DMatrix<f64>, NoValue> {
    let expected = (problem.observations().len(), problem.linear_count());
    if matrix.shape() != expected {
        return Err(NoValue::new(format!(
            "a basis of {} by {} was given where {} by {} is needed",
            matrix.nrows(),
            matrix.ncols(),
            expected.0,
            expected.1
        )));
    }
    if matrix.iter().any(|value| !value.is_finite()) {
        return Err(NoValue::new("a basis function is not finite"));
    }
    Ok(matrix)
}
