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

/// The singular value decomposition, values in falling order; `None` where it does not converge, an
/// entry is not finite, or there is no entry.
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
    SVD::try_new(matrix, left, right, f64::EPSILON, most)
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
}
