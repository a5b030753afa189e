//! Singular values of a small square matrix by one-sided Jacobi rotations.
//!
//! Applied to the transposed triangle of a pivoted QR this finds even tiny singular values with
//! high relative accuracy (Drmač & Veselić, SIAM J. Matrix Anal. Appl. 29 (2008) 1322).

use nalgebra::{DMatrix, DVector};

use super::pivoted_qr::{dot, norm};

/// A = U Σ Vᵀ of an n × n matrix, singular values in falling order.
#[derive(Debug, Clone)]
pub struct JacobiSvd {
    /// Left singular vectors, n × n; columns of zero singular values are zero.
    pub left: DMatrix<f64>,
    /// Singular values, falling.
    pub values: DVector<f64>,
    /// Right singular vectors, n × n, orthogonal.
    pub right: DMatrix<f64>,
}

/// Sweeps that suffice for any matrix seen; convergence is quadratic.
const MOST_SWEEPS: usize = 60;

impl JacobiSvd {
    /// The decomposition of a square matrix.
    pub fn new(matrix: DMatrix<f64>) -> Self {
        let n = matrix.ncols();
        let mut columns = matrix;
        let mut right = DMatrix::<f64>::identity(n, n);
        for _ in 0..MOST_SWEEPS {
            let mut rotated = false;
            for p in 0..n {
                for q in p + 1..n {
                    rotated |= orthogonalise(&mut columns, &mut right, p, q);
                }
            }
            if !rotated {
                break;
            }
        }
        sorted(columns, right)
    }
}

/// Rotates columns p and q until they are orthogonal; false when they already are.
fn orthogonalise(columns: &mut DMatrix<f64>, right: &mut DMatrix<f64>, p: usize, q: usize) -> bool {
    let (a, b) = two_columns(columns, p, q);
    let (aa, bb, ab) = (dot(a, a), dot(b, b), dot(a, b));
    if ab == 0.0 || ab.abs() <= f64::EPSILON * (aa * bb).sqrt() {
        return false;
    }
    let zeta = (bb - aa) / (2.0 * ab);
    let tangent = zeta.signum() / (zeta.abs() + 1.0_f64.hypot(zeta));
    let cosine = 1.0 / 1.0_f64.hypot(tangent);
    let sine = cosine * tangent;
    rotate(a, b, cosine, sine);
    let (u, v) = two_columns(right, p, q);
    rotate(u, v, cosine, sine);
    true
}

fn two_columns(matrix: &mut DMatrix<f64>, p: usize, q: usize) -> (&mut [f64], &mut [f64]) {
    let rows = matrix.nrows();
    let (head, tail) = matrix.as_mut_slice().split_at_mut(q * rows);
    (&mut head[p * rows..(p + 1) * rows], &mut tail[..rows])
}

fn rotate(a: &mut [f64], b: &mut [f64], cosine: f64, sine: f64) {
    for (x, y) in a.iter_mut().zip(b) {
        let old = *x;
        *x = cosine * old - sine * *y;
        *y = sine * old + cosine * *y;
    }
}

fn sorted(columns: DMatrix<f64>, right: DMatrix<f64>) -> JacobiSvd {
    let n = columns.ncols();
    let norms: Vec<f64> = (0..n).map(|j| norm(columns.column(j).as_slice())).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    let left = DMatrix::from_fn(n, n, |i, k| {
        let j = order[k];
        if norms[j] > 0.0 {
            columns[(i, j)] / norms[j]
        } else {
            0.0
        }
    });
    JacobiSvd {
        left,
        values: DVector::from_fn(n, |k, _| norms[order[k]]),
        right: DMatrix::from_fn(n, n, |i, k| right[(i, order[k])]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hilbert(n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| 1.0 / (i + j + 1) as f64)
    }

    #[test]
    fn rebuilds_the_matrix_with_orthogonal_vectors() {
        let a = hilbert(8);
        let svd = JacobiSvd::new(a.clone());
        let product = &svd.left * DMatrix::from_diagonal(&svd.values) * svd.right.transpose();
        // epsilons
        assert!((product - &a).norm() <= 50.0 * f64::EPSILON * a.norm());
        let gram = svd.right.transpose() * &svd.right;
        assert!((gram - DMatrix::<f64>::identity(8, 8)).norm() <= 50.0 * f64::EPSILON);
        assert!(svd.values.as_slice().windows(2).all(|w| w[0] >= w[1]));
    }

    #[test]
    fn a_zero_column_gives_a_zero_value() {
        let mut a = hilbert(4);
        a.set_column(2, &DVector::zeros(4));
        let svd = JacobiSvd::new(a);
        assert_eq!(svd.values[3], 0.0);
        assert!(svd.values[2] > 0.0);
    }

    #[test]
    fn scaled_columns_keep_small_values_to_full_digits() {
        // diag(1, 1e-18) times a well-conditioned matrix: the product of the values is the determinant
        let a = DMatrix::from_row_slice(2, 2, &[2.0, 1e-18, 1.0, 3e-18]);
        let svd = JacobiSvd::new(a);
        let determinant = svd.values[0] * svd.values[1];
        assert!((determinant / 5e-18 - 1.0).abs() < 10.0 * f64::EPSILON);
    }
}
