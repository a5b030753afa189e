//! Variable projection: the linear parameters solved for at every step.
//!
//! With c(α) = Φ⁺y the residual is r(α) = Φ c − y = −P⊥ y, P⊥ = I − ΦΦ⁺, a problem in α alone,
//! better conditioned and without a start for c (Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973)
//! 413). With D = ∂Φ/∂αₖ its derivative is
//!
//! ∂r/∂αₖ = P⊥ D c − (Φ⁺)ᵀ Dᵀ r,
//!
//! of which Kaufman (BIT 15 (1975) 49) keeps the first term. The second lies in the range of Φ,
//! to which r is orthogonal: both give the same gradient, hence the same minimum.

use std::sync::Mutex;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::linear::pivoted_qr::{PivotedQr, norm};
use crate::linear::triangle::Triangle;
use crate::problem::{NoValue, Problem};
use crate::separable::{SeparableProblem, checked};

/// Which Jacobian of the projected residuals is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum ProjectedJacobian {
    /// Without the second term: cheaper, and as fast to converge where residuals are small.
    #[default]
    Kaufman,
    /// Both terms, the true derivative (Golub & Pereyra).
    Full,
}

/// A separable problem as an ordinary one in its nonlinear parameters.
#[derive(Debug)]
pub struct VariableProjection<'a, P: ?Sized> {
    problem: &'a P,
    jacobian: ProjectedJacobian,
    rank_tolerance: f64,
    /// The last projection: residuals and Jacobian are asked for at the same parameters in turn.
    last: Mutex<Option<Projection>>,
}

/// The decomposed basis at some α with what follows from it.
#[derive(Debug)]
struct Projection {
    nonlinear: DVector<f64>,
    qr: PivotedQr,
    triangle: Triangle,
    linear: DVector<f64>,
    residuals: DVector<f64>,
}

impl<'a, P: SeparableProblem + ?Sized> VariableProjection<'a, P> {
    /// The projected problem; basis functions that are dependent to `rank_tolerance` (columns
    /// scaled to unit length) get the coefficient zero.
    pub fn new(problem: &'a P, jacobian: ProjectedJacobian, rank_tolerance: f64) -> Self {
        Self {
            problem,
            jacobian,
            rank_tolerance,
            last: Mutex::new(None),
        }
    }

    /// The linear parameters c(α) = Φ⁺y, length n.
    ///
    /// # Errors
    /// [`NoValue`] where the basis is not defined.
    pub fn linear_parameters(&self, nonlinear: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        self.with(nonlinear, |projection| Ok(projection.linear.clone()))
    }

    fn with<T>(
        &self,
        nonlinear: &DVector<f64>,
        use_it: impl FnOnce(&Projection) -> Result<T, NoValue>,
    ) -> Result<T, NoValue> {
        // A poisoned lock means a panic elsewhere left a projection half used: make a new one.
        let mut last = match self.last.lock() {
            Ok(guard) => guard,
            Err(poisoned) => {
                let mut guard = poisoned.into_inner();
                *guard = None;
                guard
            }
        };
        let known = last.take().filter(|p| p.nonlinear == *nonlinear);
        let projection = match known {
            Some(projection) => projection,
            None => self.project(nonlinear)?,
        };
        let answer = use_it(&projection);
        *last = Some(projection);
        answer
    }

    fn project(&self, nonlinear: &DVector<f64>) -> Result<Projection, NoValue> {
        let mut basis = checked(self.problem, self.problem.basis(nonlinear)?)?;
        let observations = self.problem.observations();
        let n = basis.ncols();
        let units = DVector::from_fn(n, |j, _| {
            let length = norm(basis.column(j).as_slice());
            if length > 0.0 { length } else { 1.0 }
        });
        for (mut column, unit) in basis.column_iter_mut().zip(units.iter()) {
            column /= *unit;
        }
        let qr = PivotedQr::new(basis);
        let triangle = Triangle::new(
            qr.upper(),
            qr.permutation().to_vec(),
            units,
            self.rank_tolerance,
        );
        let mut rotated = -observations;
        qr.apply_transposed(&mut rotated);
        let linear = triangle.basic_step(&DVector::from_fn(n, |i, _| {
            rotated.get(i).copied().unwrap_or(0.0)
        }));
        rotated.rows_mut(0, triangle.rank()).fill(0.0);
        qr.apply(&mut rotated);
        Ok(Projection {
            nonlinear: nonlinear.clone(),
            qr,
            triangle,
            linear,
            residuals: rotated,
        })
    }

    /// One column of the Jacobian: P⊥ D c, less (Φ⁺)ᵀ Dᵀ r where the full one is asked for.
    fn column(&self, projection: &Projection, derivative: &DMatrix<f64>) -> DVector<f64> {
        let rank = projection.triangle.rank();
        let mut column = derivative * &projection.linear;
        projection.qr.apply_transposed(&mut column);
        column.rows_mut(0, rank).fill(0.0);
        if self.jacobian == ProjectedJacobian::Full {
            let moved = derivative.tr_mul(&projection.residuals);
            let within = projection.triangle.transposed_solve(&moved);
            column.rows_mut(0, rank).copy_from(&(-within));
        }
        projection.qr.apply(&mut column);
        column
    }
}

impl<P: SeparableProblem + ?Sized> Problem for VariableProjection<'_, P> {
    fn parameter_count(&self) -> usize {
        self.problem.nonlinear_count()
    }

    fn residual_count(&self) -> usize {
        self.problem.observations().len()
    }

    fn residuals(&self, nonlinear: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        self.with(nonlinear, |projection| Ok(projection.residuals.clone()))
    }

    fn jacobian(&self, nonlinear: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        self.with(nonlinear, |projection| {
            let mut jacobian = DMatrix::zeros(self.residual_count(), nonlinear.len());
            for k in 0..nonlinear.len() {
                let derivative = self.problem.basis_derivative(nonlinear, k)?;
                let derivative = checked(self.problem, derivative)?;
                jacobian.set_column(k, &self.column(projection, &derivative));
            }
            Ok(jacobian)
        })
    }

    fn parameter_name(&self, index: usize) -> String {
        self.problem.nonlinear_name(index)
    }
}
