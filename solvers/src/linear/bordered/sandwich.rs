//! What local combinations of unknowns have in common under C M C, without a dense matrix.
//!
//! With C the covariance for unit noise, Z = (R_ccᵀR_cc)⁻¹ and P, U, C_y as in
//! [`BorderedCovariance`],
//!
//! ```text
//!     C = [Z 0; 0 0] + F D Fᵀ,   F = [U P; I 0],   D = [C_y 0; 0 −I],
//!     C M C = [Z M_cc Z 0; 0 0] + H D Fᵀ + F D Hᵀ + F D (FᵀMF) D Fᵀ,   H = [Z 0; 0 0] M F.
//! ```
//!
//! Z and Z M_cc Z are needed where combinations have unknowns only: in a band.

use nalgebra::{DMatrix, DVector};

use super::covariance::BorderedCovariance;
use super::symmetric::BorderedSymmetric;
use crate::linear::banded::BandSandwich;

/// A linear combination of few unknowns: the numbers of those that it has, each with its weight.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Combination {
    /// Of the band.
    pub band: Vec<(usize, f64)>,
    /// Of the border.
    pub border: Vec<(usize, f64)>,
}

/// C and C M C between combinations of unknowns that are near each other, of a covariance C for unit noise and a
/// symmetric M: where rows have the covariance V and M = JᵀVJ, what least squares has that weighs all alike.
#[derive(Debug, Clone)]
pub struct Sandwich {
    near: BandSandwich,
    /// F above the border's unit matrix, a row each unknown of the band.
    beside: DMatrix<f64>,
    /// H likewise.
    through: DMatrix<f64>,
    /// D.
    own: DMatrix<f64>,
    /// D FᵀMF D.
    squared: DMatrix<f64>,
}

impl Sandwich {
    /// Of a covariance and M over the same unknowns, for unknowns of the band less than `width` apart.
    pub fn new(covariance: &BorderedCovariance, middle: &BorderedSymmetric, width: usize) -> Self {
        let (of_band, border) = (covariance.of_band(), covariance.border());
        let (triangle, q) = (&covariance.triangle, border.nrows());
        let (n, p) = (triangle.len(), of_band.p.ncols());
        let beside = DMatrix::from_fn(n, q + p, |i, l| {
            if l < q {
                of_band.u[(i, l)]
            } else {
                of_band.p[(i, l - q)]
            }
        });
        let own = DMatrix::from_fn(q + p, q + p, |k, l| match (k < q && l < q, k == l) {
            (true, _) => border[(k, l)],
            (false, true) => -1.0,
            (false, false) => 0.0,
        });
        let mut through = DMatrix::zeros(n, q + p);
        let mut seen = DMatrix::zeros(q + p, q + p);
        for l in 0..q + p {
            let mut column: Vec<f64> = beside.column(l).iter().copied().collect();
            column.extend((0..q).map(|j| if j == l { 1.0 } else { 0.0 }));
            let mut product = middle.times(&column);
            let of_border = product.split_off(n);
            let mut product = DVector::from_vec(product);
            let mut common = beside.tr_mul(&product);
            for (sum, value) in common.iter_mut().zip(of_border) {
                *sum += value;
            }
            seen.set_column(l, &common);
            triangle.solve_transposed(product.as_mut_slice());
            triangle.solve(product.as_mut_slice());
            through.set_column(l, &product);
        }
        Self {
            near: BandSandwich::of(triangle, middle.band_rows(), width),
            squared: &own * seen * &own,
            beside,
            through,
            own,
        }
    }

    /// Fᵀa.
    fn seen(&self, a: &Combination) -> DVector<f64> {
        let mut seen = weighed(&self.beside, a);
        for (j, value) in &a.border {
            seen[*j] += value;
        }
        seen
    }

    /// aᵀC b; unknowns of the band farther apart than the width count as having nothing in common but through
    /// the border.
    pub fn covariance(&self, a: &Combination, b: &Combination) -> f64 {
        let through = self.seen(a).dot(&(&self.own * self.seen(b)));
        between(a, b, |i, j| self.near.inverse(i, j)) + through
    }

    /// aᵀC M C a; see [`covariance`](Self::covariance) for the width.
    pub fn form(&self, a: &Combination) -> f64 {
        let seen = self.seen(a);
        let through = weighed(&self.through, a).dot(&(&self.own * &seen));
        between(a, a, |i, j| self.near.product(i, j))
            + 2.0 * through
            + seen.dot(&(&self.squared * &seen))
    }
}

/// Σ over the unknowns of the band of weight times row.
fn weighed(rows: &DMatrix<f64>, a: &Combination) -> DVector<f64> {
    let mut sum = DVector::zeros(rows.ncols());
    for (i, weight) in &a.band {
        for (sum, value) in sum.iter_mut().zip(rows.row(*i).iter()) {
            *sum += weight * value;
        }
    }
    sum
}

/// Σ over pairs of unknowns of the band.
fn between(a: &Combination, b: &Combination, element: impl Fn(usize, usize) -> f64) -> f64 {
    let one = |i: usize| -> f64 { b.band.iter().map(|(j, v)| v * element(i, *j)).sum() };
    a.band.iter().map(|(i, w)| w * one(*i)).sum()
}
