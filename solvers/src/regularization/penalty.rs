//! What a regularized solution is asked to keep small.

use nalgebra::DMatrix;

/// The matrix L of ‖Lx‖.
#[derive(Debug, Clone, PartialEq)]
pub enum Penalty {
    /// The solution itself.
    Identity,
    /// Differences of neighbours, n − 1 rows (−1, 1).
    FirstDifference,
    /// Second differences, n − 2 rows (1, −2, 1).
    SecondDifference,
    /// Any matrix with as many columns as there are unknowns; its rows may depend on each other.
    Custom(DMatrix<f64>),
}

impl Penalty {
    /// L for `unknowns` unknowns, rows × unknowns.
    pub fn matrix(&self, unknowns: usize) -> DMatrix<f64> {
        match self {
            Self::Identity => DMatrix::identity(unknowns, unknowns),
            Self::FirstDifference => differences(unknowns, &[-1.0, 1.0]),
            Self::SecondDifference => differences(unknowns, &[1.0, -2.0, 1.0]),
            Self::Custom(matrix) => matrix.clone(),
        }
    }

    /// The coefficients of one row of a stationary penalty, absent for a custom matrix.
    pub fn stencil(&self) -> Option<&'static [f64]> {
        match self {
            Self::Identity => Some(&[1.0]),
            Self::FirstDifference => Some(&[-1.0, 1.0]),
            Self::SecondDifference => Some(&[1.0, -2.0, 1.0]),
            Self::Custom(_) => None,
        }
    }
}

fn differences(unknowns: usize, stencil: &[f64]) -> DMatrix<f64> {
    let rows = (unknowns + 1).saturating_sub(stencil.len());
    let mut matrix = DMatrix::zeros(rows, unknowns);
    for row in 0..rows {
        for (offset, coefficient) in stencil.iter().enumerate() {
            matrix[(row, row + offset)] = *coefficient;
        }
    }
    matrix
}
