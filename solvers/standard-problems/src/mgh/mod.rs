//! The collection of Moré, Garbow & Hillstrom (ACM TOMS 7 (1981) 17), problems numbered as there.
//!
//! Each problem has its standard start x₀, used also at 10 x₀ and 100 x₀, and the published
//! minima of f = Σ r² (twice the cost of a fit). Minima at infinity are marked.

use errsep_solvers::{NoValue, Problem};
use nalgebra::{DMatrix, DVector};

use crate::dual::Dual;
use crate::strd::dual_parameters;

mod curves;
mod families;
mod valleys;

/// A published minimum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// f = Σ r², to the digits published.
    pub sum_of_squares: f64,
    /// Whether it is approached only as parameters go to infinity.
    pub at_infinity: bool,
}

/// One problem of the collection.
#[derive(Debug, Clone)]
pub struct Standard {
    /// Number in the paper and name.
    pub name: &'static str,
    /// The standard start, length n.
    pub start: Vec<f64>,
    /// Published minima, the global one first.
    pub minima: Vec<Minimum>,
    values: fn(&[f64]) -> Vec<f64>,
    duals: fn(&[Dual]) -> Vec<Dual>,
}

impl Standard {
    /// The start `factor` times farther than the standard one.
    pub fn start_times(&self, factor: f64) -> DVector<f64> {
        DVector::from_vec(self.start.clone()) * factor
    }
}

impl Problem for Standard {
    fn parameter_count(&self) -> usize {
        self.start.len()
    }

    fn residual_count(&self) -> usize {
        (self.values)(&self.start).len()
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(DVector::from_vec((self.values)(p.as_slice())))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let rows = (self.duals)(&dual_parameters(p));
        Ok(DMatrix::from_fn(rows.len(), p.len(), |i, j| {
            rows[i].gradient[j]
        }))
    }

    fn parameter_name(&self, index: usize) -> String {
        format!("x{}", index + 1)
    }
}

/// A problem from its formula, start and published minima; those at infinity come last.
macro_rules! standard {
    ($name:literal, $formula:ident, $start:expr, [$($minimum:expr),*] $(, infinite [$($far:expr),*])?) => {
        $crate::mgh::Standard {
            name: $name,
            start: $start.to_vec(),
            minima: vec![
                $($crate::mgh::Minimum { sum_of_squares: $minimum, at_infinity: false },)*
                $($($crate::mgh::Minimum { sum_of_squares: $far, at_infinity: true },)*)?
            ],
            values: $formula::<f64>,
            duals: $formula::<$crate::dual::Dual>,
        }
    };
}
use standard;

/// Every problem of the collection that is kept here, by number.
pub fn problems() -> Vec<Standard> {
    let mut all = valleys::problems();
    all.extend(curves::problems());
    all.extend(families::problems());
    all.sort_by_key(|p| p.name);
    all
}

/// The problem whose name begins with a number.
pub fn problem(number: &str) -> Option<Standard> {
    problems().into_iter().find(|p| p.name.starts_with(number))
}
