//! Least squares of least norm in the border of the triangle, a small dense matrix that may be of
//! deficient rank, with measured slopes beside it.

use super::design::decompose;
use super::readings::DiagonalError;
use crate::uncertainty::DegreesOfFreedom;
use errsep_solvers::linear::pivoted_qr::PivotedQr;
use nalgebra::{DMatrix, DVector};

/// What a measured slope must share with the directions that the readings leave open to determine one
/// of them: those are known to about 1e-11, and what a set-up leaves open shows with more than 1e-4.
pub(super) const OPEN: f64 = 1e-6;

/// A measured slope as a row of the border, weighted to the noise of a reading.
pub(super) struct SlopeRow {
    /// Column of the border.
    pub(super) column: usize,
    pub(super) coefficient: f64,
    pub(super) value: f64,
    pub(super) degrees_of_freedom: DegreesOfFreedom,
}

/// Least squares of least norm: parameters, and their half covariance W with (MᵀM)⁺ = W Wᵀ.
pub(super) struct Solution {
    /// Orthonormal basis of what is determined, n × rank.
    determined: DMatrix<f64>,
    /// Orthonormal basis of what is not, n × nullity.
    pub(super) null: DMatrix<f64>,
    pub(super) parameters: DVector<f64>,
    pub(super) half_covariance: DMatrix<f64>,
}

impl Solution {
    /// That of the readings alone; singular values up to `floor` count as zero.
    ///
    /// # Errors
    /// Singular values do not converge.
    pub(super) fn of_readings(
        matrix: &DMatrix<f64>,
        right: &DVector<f64>,
        floor: f64,
    ) -> Result<Self, DiagonalError> {
        let decomposition = decompose(matrix, floor)?;
        let n = matrix.ncols();
        let rank = decomposition.determined.len();
        let mut half_covariance = DMatrix::zeros(n, rank);
        let mut determined = DMatrix::zeros(n, rank);
        for (k, (value, v)) in decomposition.determined.iter().enumerate() {
            half_covariance.set_column(k, &(v / *value));
            determined.set_column(k, v);
        }
        let parameters = &half_covariance * half_covariance.tr_mul(&matrix.tr_mul(right));
        Ok(Self {
            determined,
            null: decomposition.null,
            parameters,
            half_covariance,
        })
    }

    /// The solution with measured slopes beside the readings.
    ///
    /// What the slopes determine further is sought among what the readings leave open, by their
    /// direction alone: the rank must not depend on how well a slope is known. In the basis of what
    /// both determine the problem has full rank, and Householder reflections with pivoted columns and
    /// the heavy rows first solve it whatever the weights (Cox & Higham, BIT 38 (1998) 34).
    ///
    /// # Errors
    /// Singular values do not converge.
    pub(super) fn joined(
        &self,
        matrix: &DMatrix<f64>,
        right: &DVector<f64>,
        slopes: &[SlopeRow],
    ) -> Result<Self, DiagonalError> {
        let (readings, n) = matrix.shape();
        let rows = DMatrix::from_fn(slopes.len(), self.null.ncols(), |k, j| {
            self.null[(slopes[k].column, j)]
        });
        let further = decompose(&rows, OPEN)?;
        let added: Vec<DVector<f64>> = further
            .determined
            .iter()
            .map(|(_, v)| &self.null * v)
            .collect();
        let from_readings = self.rank();
        let rank = from_readings + added.len();
        let mut determined = self.determined.clone().resize_horizontally(rank, 0.0);
        for (k, direction) in added.iter().enumerate() {
            determined.set_column(from_readings + k, direction);
        }

        let mut order: Vec<usize> = (0..slopes.len()).collect();
        order.sort_by(|&a, &b| slopes[b].coefficient.total_cmp(&slopes[a].coefficient));
        let heavy = order.partition_point(|&k| slopes[k].coefficient > 1.0);
        let (before, after) = order.split_at(heavy);
        let mut weighted = DMatrix::zeros(readings + slopes.len(), rank);
        let mut observed = DVector::zeros(readings + slopes.len());
        let of_slopes = before.iter().enumerate().chain(
            after
                .iter()
                .enumerate()
                .map(|(i, k)| (heavy + readings + i, k)),
        );
        for (row, &k) in of_slopes {
            let slope = &slopes[k];
            weighted.set_row(row, &(determined.row(slope.column) * slope.coefficient));
            observed[row] = slope.value;
        }
        // What the slopes add leaves the readings alone: zero, not the rounding of M times it.
        weighted
            .view_mut((heavy, 0), (readings, from_readings))
            .copy_from(&(matrix * &self.determined));
        observed.rows_mut(heavy, readings).copy_from(right);

        let qr = PivotedQr::new(weighted);
        qr.apply_transposed(&mut observed);
        let mut permuted = DMatrix::zeros(n, rank);
        for (k, &j) in qr.permutation().iter().enumerate() {
            permuted.set_column(k, &determined.column(j));
        }
        let inverse = qr
            .upper()
            .solve_upper_triangular(&DMatrix::identity(rank, rank))
            .ok_or_else(|| DiagonalError::Numerical {
                reason: "the measured slopes and the readings make no triangle".to_owned(),
            })?;
        let half_covariance = permuted * inverse;
        let parameters = &half_covariance * observed.rows(0, rank);
        Ok(Self {
            determined,
            null: &self.null * further.null,
            parameters,
            half_covariance,
        })
    }

    /// Number of combinations determined.
    pub(super) fn rank(&self) -> usize {
        self.determined.ncols()
    }
}
