//! The certified problems that are linear in some of their parameters.

use std::f64::consts::TAU;

use errsep_solvers::{NoValue, SeparableProblem};
use nalgebra::{DMatrix, DVector};

use crate::dual::{Dual, Scalar};
use crate::strd::{Certified, dual_parameters};

/// A certified problem as Φ(α) c, with the places of α and c among the certified parameters.
#[derive(Debug, Clone)]
pub struct Separable {
    observations: DVector<f64>,
    predictors: Vec<f64>,
    /// Certified indices of the nonlinear parameters.
    pub nonlinear: &'static [usize],
    /// Certified indices of the linear parameters.
    pub linear: &'static [usize],
    values: fn(&[f64], f64) -> Vec<f64>,
    duals: fn(&[Dual], f64) -> Vec<Dual>,
}

/// The data sets that are offered in separable form.
pub const NAMES: [&str; 10] = [
    "Misra1a", "BoxBOD", "Lanczos1", "Lanczos2", "Lanczos3", "Gauss1", "Gauss2", "Gauss3", "MGH17",
    "ENSO",
];

impl Separable {
    /// The separable form of a certified problem, where it is offered.
    pub fn of(problem: &Certified) -> Option<Self> {
        macro_rules! form {
            ($basis:ident, $nonlinear:expr, $linear:expr) => {
                (
                    {
                        const PLACES: &[usize] = &$nonlinear;
                        PLACES
                    },
                    {
                        const PLACES: &[usize] = &$linear;
                        PLACES
                    },
                    $basis::<f64> as fn(&[f64], f64) -> Vec<f64>,
                    $basis::<Dual> as fn(&[Dual], f64) -> Vec<Dual>,
                )
            };
        }
        let (nonlinear, linear, values, duals) = match problem.name.as_str() {
            "Misra1a" | "BoxBOD" => form!(saturation, [1], [0]),
            "Lanczos1" | "Lanczos2" | "Lanczos3" => form!(exponentials, [1, 3, 5], [0, 2, 4]),
            "Gauss1" | "Gauss2" | "Gauss3" => form!(bells, [1, 3, 4, 6, 7], [0, 2, 5]),
            "MGH17" => form!(decays, [3, 4], [0, 1, 2]),
            "ENSO" => form!(cycles, [3, 6], [0, 1, 2, 4, 5, 7, 8]),
            _ => return None,
        };
        Some(Self {
            observations: DVector::from_column_slice(problem.responses()),
            predictors: problem.predictors().iter().map(|x| x[0]).collect(),
            nonlinear,
            linear,
            values,
            duals,
        })
    }

    /// The nonlinear entries of a list in certified order.
    pub fn nonlinear_of(&self, all: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.nonlinear.len(), self.nonlinear.iter().map(|&j| all[j]))
    }

    /// A list in the order (α, c) put back into certified order.
    pub fn certified_order(&self, joint: &DVector<f64>) -> Vec<f64> {
        let mut all = vec![0.0; joint.len()];
        for (value, &j) in joint.iter().zip(self.nonlinear.iter().chain(self.linear)) {
            all[j] = *value;
        }
        all
    }
}

impl SeparableProblem for Separable {
    fn nonlinear_count(&self) -> usize {
        self.nonlinear.len()
    }

    fn linear_count(&self) -> usize {
        self.linear.len()
    }

    fn observations(&self) -> &DVector<f64> {
        &self.observations
    }

    fn basis(&self, nonlinear: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let mut basis = DMatrix::zeros(self.predictors.len(), self.linear.len());
        for (i, &x) in self.predictors.iter().enumerate() {
            for (j, value) in (self.values)(nonlinear.as_slice(), x)
                .into_iter()
                .enumerate()
            {
                basis[(i, j)] = value;
            }
        }
        Ok(basis)
    }

    fn basis_derivative(
        &self,
        nonlinear: &DVector<f64>,
        index: usize,
    ) -> Result<DMatrix<f64>, NoValue> {
        let parameters = dual_parameters(nonlinear);
        let mut derivative = DMatrix::zeros(self.predictors.len(), self.linear.len());
        for (i, &x) in self.predictors.iter().enumerate() {
            for (j, value) in (self.duals)(&parameters, x).into_iter().enumerate() {
                derivative[(i, j)] = value.gradient[index];
            }
        }
        Ok(derivative)
    }

    fn nonlinear_name(&self, index: usize) -> String {
        format!("b{}", self.nonlinear[index] + 1)
    }

    fn linear_name(&self, index: usize) -> String {
        format!("b{}", self.linear[index] + 1)
    }
}

fn saturation<T: Scalar>(a: &[T], x: f64) -> Vec<T> {
    vec![-(-a[0] * x).exp() + 1.0]
}

fn exponentials<T: Scalar>(a: &[T], x: f64) -> Vec<T> {
    a.iter().map(|&rate| (-rate * x).exp()).collect()
}

fn bells<T: Scalar>(a: &[T], x: f64) -> Vec<T> {
    let bell = |centre: T, width: T| {
        let z = (-centre + x) / width;
        (-(z * z)).exp()
    };
    vec![(-a[0] * x).exp(), bell(a[1], a[2]), bell(a[3], a[4])]
}

fn decays<T: Scalar>(a: &[T], x: f64) -> Vec<T> {
    let mut basis = vec![T::constant(1.0)];
    basis.extend(exponentials(a, x));
    basis
}

fn cycles<T: Scalar>(a: &[T], x: f64) -> Vec<T> {
    let year = TAU * x / 12.0;
    let mut basis = vec![
        T::constant(1.0),
        T::constant(year.cos()),
        T::constant(year.sin()),
    ];
    for period in a {
        let phase = period.powi(-1) * (TAU * x);
        basis.extend([phase.cos(), phase.sin()]);
    }
    basis
}
