//! Orthonormal bases of tall columns.

use nalgebra::DMatrix;

/// Columns that project to less than this part of their length lie in the span of the others.
const DEPENDENT: f64 = 1e-7;

/// Columns below which products are taken one by one.
const FEW: usize = 8;

/// AᵀB of tall matrices, by blocks where there are many products.
pub(crate) fn inner_products(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    if a.ncols().min(b.ncols()) < FEW {
        a.tr_mul(b)
    } else {
        a.transpose() * b
    }
}

/// Columns that are projected together off those before them.
const PANEL: usize = 48;

/// An orthonormal basis of the columns that are longer than rounding compared with `sizes`: Gram and Schmidt's, twice
/// (Giraud, Langou and Rozložník 2005), by panels, whose products are those of matrices.
pub(crate) fn orthonormal(columns: &DMatrix<f64>, sizes: &[f64]) -> DMatrix<f64> {
    with_volume(columns, sizes).0
}

/// The same, and the logarithm of the volume that the columns it is made of span.
pub(crate) fn with_volume(columns: &DMatrix<f64>, sizes: &[f64]) -> (DMatrix<f64>, f64) {
    let (rows, count) = columns.shape();
    let mut kept = DMatrix::<f64>::zeros(rows, count);
    let mut rank = 0;
    let mut log_volume = 0.0;
    for from in (0..count).step_by(PANEL) {
        let mut panel = columns.columns(from, PANEL.min(count - from)).into_owned();
        let before = kept.columns(0, rank).into_owned();
        let transposed = before.transpose();
        for _ in 0..2 {
            let along = &transposed * &panel;
            panel.gemm(-1.0, &before, &along, 1.0);
        }
        for (column, size) in panel.column_iter().zip(&sizes[from..]) {
            let mut vector = column.clone_owned();
            let length = vector.norm();
            for _ in 0..2 {
                for k in before.ncols()..rank {
                    let other = kept.column(k);
                    let along = other.dot(&vector);
                    vector.axpy(-along, &other, 1.0);
                }
            }
            // What the panel took away leaves the rounding of the columns before it a larger share.
            if vector.norm() < 0.5 * length {
                let along = &transposed * &vector;
                vector.gemv(-1.0, &before, &along, 1.0);
            }
            let length = vector.norm();
            if length > DEPENDENT * size && length > 0.0 {
                kept.set_column(rank, &(vector / length));
                rank += 1;
                log_volume += length.ln();
            }
        }
    }
    (kept.columns(0, rank).into_owned(), log_volume)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// *Property*: over several panels, with columns that lie in the span of others but for a part of 1e-5 and others that
    /// lie in it, the basis is orthonormal and spans all columns, to rounding over that part.
    #[test]
    fn a_basis_is_orthonormal_and_spans() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (rows, own) = (400, 130);
        let mut columns = DMatrix::from_fn(rows, own + 40, |_, _| rng.random_range(-1.0..1.0));
        for k in own..own + 40 {
            let near = columns.column(k - 100) - columns.column(k - 90) * 2.0;
            let apart = if k % 2 == 0 { 1e-5 } else { 0.0 };
            let column = near + columns.column(k) * apart;
            columns.set_column(k, &column);
        }
        let sizes: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
        let basis = orthonormal(&columns, &sizes);
        assert_eq!(basis.ncols(), own + 20);
        let off = basis.tr_mul(&basis) - DMatrix::identity(own + 20, own + 20);
        assert!(off.amax() < 1e-12, "{}", off.amax());
        let left = &columns - &basis * basis.tr_mul(&columns);
        assert!(left.amax() < 1e-12, "{}", left.amax());
    }
}
