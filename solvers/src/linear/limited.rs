//! nalgebra's iterative decompositions with a limit on their iterations.
//!
//! Without one they never return where entries differ by so many decades that a rotation changes
//! nothing, or where an entry is not finite.

use nalgebra::allocator::Allocator;
use nalgebra::{
    DefaultAllocator, Dim, DimDiff, DimMin, DimMinimum, DimSub, OMatrix, SVD, SymmetricEigen, U1,
};

/// Iterations for a matrix of so many columns; two or three a column are usual, LAPACK allows 30.
fn most_iterations(columns: usize) -> usize {
    100 * (columns + 10)
}

/// The singular value decomposition, values in falling order, checked against the matrix; `None` where it
/// does not converge, an entry is not finite, or there is no entry.
pub fn svd<R, C>(matrix: OMatrix<f64, R, C>, left: bool, right: bool) -> Option<SVD<f64, R, C>>
where
    R: DimMin<C>,
    C: Dim,
    DimMinimum<R, C>: DimSub<U1>,
    DefaultAllocator: Allocator<R, C>
        + Allocator<C>
        + Allocator<R>
        + Allocator<DimDiff<DimMinimum<R, C>, U1>>
        + Allocator<DimMinimum<R, C>, C>
        + Allocator<R, DimMinimum<R, C>>
        + Allocator<DimMinimum<R, C>>,
{
    if matrix.is_empty() || !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    let most = most_iterations(matrix.nrows().max(matrix.ncols()));
    let greatest = matrix.amax();
    let decomposed = |matrix: OMatrix<f64, R, C>, tolerance: f64| {
        let found = SVD::try_new(matrix.clone(), left, right, tolerance, most)?;
        rebuilds(&found, &matrix).then_some(found)
    };
    // Entries such as cos 90° = 6 · 10⁻¹⁷ beside ones can lead the iteration to factors of another matrix.
    // With a wider tolerance, or without them, which changes less than rounding does, it goes right.
    decomposed(matrix.clone(), f64::EPSILON)
        .or_else(|| decomposed(matrix.clone(), 5.0 * f64::EPSILON))
        .or_else(|| {
            let least = f64::EPSILON * greatest;
            let plain = matrix.map(|v| if v.abs() < least { 0.0 } else { v });
            decomposed(plain, f64::EPSILON)
        })
        // Squares of very small numbers vanish, and nothing can be compared.
        .or_else(|| SVD::try_new(matrix.clone(), left, right, f64::EPSILON, most))
}

/// Part of a matrix's norm by which its factors may miss it. Those of three columns are made from squares,
/// so that they keep half of the digits only; factors of another matrix miss by a tenth and more.
const MISSED: f64 = 1e-6;

/// Whether factors are those of a matrix, as far as those that were asked for tell: U Σ Vᵀ, or the
/// lengths of A V or of Uᵀ A, which are the singular values.
fn rebuilds<R, C>(found: &SVD<f64, R, C>, matrix: &OMatrix<f64, R, C>) -> bool
where
    R: DimMin<C>,
    C: Dim,
    DimMinimum<R, C>: DimSub<U1>,
    DefaultAllocator: Allocator<R, C>
        + Allocator<C>
        + Allocator<R>
        + Allocator<DimDiff<DimMinimum<R, C>, U1>>
        + Allocator<DimMinimum<R, C>, C>
        + Allocator<R, DimMinimum<R, C>>
        + Allocator<DimMinimum<R, C>>,
{
    let values = &found.singular_values;
    let reach = MISSED * matrix.norm();
    let along = |lengths: &mut dyn Iterator<Item = f64>| {
        lengths
            .zip(values.iter())
            .all(|(length, value)| (length - value).abs() <= reach)
    };
    match (&found.u, &found.v_t) {
        (Some(u), Some(v_t)) => {
            let rank = values.len();
            let missed = (0..matrix.ncols()).map(|j| {
                let column = (0..matrix.nrows()).map(|i| {
                    let sum: f64 = (0..rank).map(|k| u[(i, k)] * values[k] * v_t[(k, j)]).sum();
                    (sum - matrix[(i, j)]).powi(2)
                });
                column.sum::<f64>()
            });
            missed.sum::<f64>().sqrt() <= reach
        }
        (None, Some(v_t)) => along(&mut v_t.row_iter().map(|v| {
            let along = (0..matrix.nrows()).map(|i| {
                let sum: f64 = (0..matrix.ncols()).map(|j| matrix[(i, j)] * v[j]).sum();
                sum * sum
            });
            along.sum::<f64>().sqrt()
        })),
        (Some(u), None) => along(&mut u.column_iter().map(|u| {
            let along = (0..matrix.ncols()).map(|j| {
                let sum: f64 = (0..matrix.nrows()).map(|i| matrix[(i, j)] * u[i]).sum();
                sum * sum
            });
            along.sum::<f64>().sqrt()
        })),
        (None, None) => (values.norm() - matrix.norm()).abs() <= reach,
    }
}

/// Eigenvalues and eigenvectors of a symmetric matrix; `None`
/// where they do not converge or an entry is not finite.
pub fn symmetric_eigen<D>(matrix: OMatrix<f64, D, D>) -> Option<SymmetricEigen<f64, D>>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    if !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    let most = most_iterations(matrix.ncols());
    SymmetricEigen::try_new(matrix, f64::EPSILON, most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, Matrix3};

    #[test]
    fn what_cannot_be_decomposed_is_refused() {
        for bad in [f64::NAN, f64::INFINITY] {
            let matrix = DMatrix::from_row_slice(2, 2, &[1.0, bad, 2.0, 3.0]);
            assert!(svd(matrix.clone(), true, true).is_none());
            assert!(symmetric_eigen(matrix).is_none());
        }
        assert!(svd(DMatrix::<f64>::zeros(0, 3), true, true).is_none());
    }

    #[test]
    fn ordinary_matrices_are_rebuilt() {
        let matrix = Matrix3::new(4.0, 1.0, -2.0, 1.0, 3.0, 0.5, -2.0, 0.5, 1.0);
        let factors = svd(matrix, true, true).expect("small and finite");
        let rebuilt = factors.recompose().expect("both sides asked for");
        // epsilons
        assert!((rebuilt - matrix).norm() <= 20.0 * f64::EPSILON * matrix.norm());
        let eigen = symmetric_eigen(matrix).expect("small and finite");
        assert!((eigen.recompose() - matrix).norm() <= 20.0 * f64::EPSILON * matrix.norm());
    }

    /// Four indicators and two spindle positions: the cosines of right angles are no zeros.
    #[test]
    fn entries_that_are_nearly_nothing_lead_nowhere_else() {
        let channels: Vec<[f64; 2]> = [0.0, 180.0, 90.0, 270.0]
            .iter()
            .flat_map(|phi: &f64| [0.0, 180.0].map(|theta| [*phi, (phi - theta).rem_euclid(360.0)]))
            .map(|angles| angles.map(f64::to_radians))
            .collect();
        let design = DMatrix::from_fn(channels.len(), 6, |i, j| {
            let [phi, psi] = channels[i];
            let cosines = [phi.cos(), phi.sin(), psi.cos(), psi.sin(), 1.0];
            cosines.get(j).copied().unwrap_or(0.5 * (2.0 * psi).cos())
        });
        // epsilons: 48 entries of order one, condition below five
        let inverse = svd(design.clone(), true, true).expect("well conditioned");
        let inverse = inverse.pseudo_inverse(1e-12).expect("both sides asked for");
        let unit = &inverse * &design;
        assert!((unit - DMatrix::identity(6, 6)).norm() < 100.0 * f64::EPSILON);
        for (left, right) in [(true, false), (false, true), (false, false)] {
            let one = svd(design.clone(), left, right).expect("well conditioned");
            let square = one.singular_values.norm_squared();
            assert!((square - design.norm_squared()).abs() < 100.0 * f64::EPSILON * square);
            let left_lengths = one.u.map(|u| (u.transpose() * &design).norm());
            let right_lengths = one.v_t.map(|v| (&design * v.transpose()).norm());
            for length in left_lengths.into_iter().chain(right_lengths) {
                assert!((length * length - square).abs() < 100.0 * f64::EPSILON * square);
            }
        }
    }

    /// Points exactly on a circle, and numbers whose squares vanish, are decomposed like any others.
    #[test]
    fn small_and_nearly_singular_matrices_are_not_refused() {
        let singular = Matrix3::new(3.0, 1.0, 4.0, 0.0, 2.0, 2.0, 0.0, 0.0, 1e-14);
        for matrix in [singular, 1e-200 * singular, 1e100 * singular] {
            for (left, right) in [(true, true), (false, true), (true, false)] {
                let found = svd(matrix, left, right).expect("finite");
                assert_eq!((found.u.is_some(), found.v_t.is_some()), (left, right));
            }
        }
    }
}
