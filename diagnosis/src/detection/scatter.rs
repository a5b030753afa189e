//! The root of the covariance of scatter that a model expects beside the noise.
//!
//! In whitened readings the columns U of that scatter add U Uᵀ to I. With U = Q Λ^½ (Q orthonormal)
//! I − Q (1 − (1 + Λ)^−½) Qᵀ is the inverse root. Columns of single points touch a few readings and
//! are taken out first, point by point; the few common to all readings after them.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::detection::shared_scatter::SharedRoot;

/// Scatter of less than this part of the noise's variance is none.
const SLIGHT: f64 = 1e-9;

/// The inverse root of the scatter that a model expects.
#[derive(Debug, Clone)]
pub(crate) enum Scatter {
    /// Of points, each by its own.
    Points(ScatterRoot),
    /// Common to traces.
    Shared(SharedRoot),
}

impl Scatter {
    /// The root times a vector, in place.
    pub fn apply(&self, vector: &mut [f64]) {
        match self {
            Self::Points(root) => root.apply(vector),
            Self::Shared(root) => root.apply(vector),
        }
    }

    /// ln |I + U Uᵀ|.
    pub fn log_determinant(&self) -> f64 {
        match self {
            Self::Points(root) => root.log_determinant(),
            Self::Shared(root) => root.log_determinant(),
        }
    }

    /// The transposed root times a vector, in place.
    pub fn apply_transposed(&self, vector: &mut [f64]) {
        match self {
            Self::Points(root) => root.apply_transposed(vector),
            Self::Shared(root) => root.apply(vector),
        }
    }
}

/// A direction in some readings, of unit length, and the part of it that is taken away.
#[derive(Debug, Clone)]
struct Direction {
    rows: Vec<usize>,
    values: Vec<f64>,
    part: f64,
}

/// The inverse root.
#[derive(Debug, Clone)]
pub(crate) struct ScatterRoot {
    own: Vec<Direction>,
    common: Vec<Direction>,
}

impl ScatterRoot {
    /// The root of whitened columns, one standard deviation each.
    pub fn new(columns: impl Iterator<Item = DVector<f64>>) -> Self {
        let mut groups: BTreeMap<Vec<usize>, Vec<DVector<f64>>> = BTreeMap::new();
        let mut readings = 0;
        for column in columns {
            readings = column.len();
            let rows: Vec<usize> = (0..readings).filter(|i| column[*i] != 0.0).collect();
            let own = column.select_rows(&rows);
            groups.entry(rows).or_default().push(own);
        }
        // Those that share no reading with a smaller group can be taken by themselves.
        let mut used = vec![false; readings];
        let mut by_size: Vec<(Vec<usize>, Vec<DVector<f64>>)> = groups.into_iter().collect();
        by_size.sort_by_key(|(rows, _)| rows.len());
        let (mut own, mut rest) = (Vec::new(), Vec::new());
        for (rows, members) in by_size {
            if rows.iter().any(|i| used[*i]) {
                rest.extend(members.into_iter().map(|m| (rows.clone(), m)));
                continue;
            }
            rows.iter().for_each(|i| used[*i] = true);
            own.extend(directions(&members, &rows));
        }
        let mut root = Self {
            own,
            common: Vec::new(),
        };
        let rest: Vec<DVector<f64>> = rest
            .into_iter()
            .map(|(rows, values)| {
                let mut dense = DVector::zeros(readings);
                rows.iter().zip(&values).for_each(|(i, v)| dense[*i] = *v);
                root.apply(dense.as_mut_slice());
                dense
            })
            .collect();
        let all: Vec<usize> = (0..readings).collect();
        root.common = directions(&rest, &all);
        root
    }

    /// ln |I + U Uᵀ|.
    pub fn log_determinant(&self) -> f64 {
        let all = self.own.iter().chain(&self.common);
        all.map(|d| -2.0 * (1.0 - d.part).ln()).sum()
    }

    /// The root times a vector, in place.
    pub fn apply(&self, vector: &mut [f64]) {
        self.own.iter().for_each(|d| d.take(vector));
        self.common.iter().for_each(|d| d.take(vector));
    }

    /// The transposed root times a vector, in place.
    pub fn apply_transposed(&self, vector: &mut [f64]) {
        self.common.iter().for_each(|d| d.take(vector));
        self.own.iter().for_each(|d| d.take(vector));
    }
}

impl Direction {
    fn take(&self, vector: &mut [f64]) {
        let pairs = || self.rows.iter().zip(&self.values);
        let along: f64 = pairs().map(|(i, v)| vector[*i] * v).sum();
        for (i, v) in pairs() {
            vector[*i] -= self.part * along * v;
        }
    }
}

/// Principal directions of some columns, which stand in the given rows.
fn directions(columns: &[DVector<f64>], rows: &[usize]) -> Vec<Direction> {
    if columns.is_empty() || rows.is_empty() {
        return Vec::new();
    }
    let columns = DMatrix::from_columns(columns);
    let eigen = SymmetricEigen::new(columns.tr_mul(&columns));
    eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
        .filter(|(variance, _)| **variance > SLIGHT)
        .map(|(variance, combination)| {
            let direction: DVector<f64> = &columns * combination / variance.sqrt();
            Direction {
                rows: rows.to_vec(),
                values: direction.as_slice().to_vec(),
                part: 1.0 - 1.0 / (1.0 + variance).sqrt(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// R (I + U Uᵀ) Rᵀ = I for points of two readings and columns common to all.
        #[test]
        fn the_covariance_becomes_the_identity(
            values in prop::collection::vec(-3.0f64..3.0, 4 * 5 + 2 * 10),
        ) {
            let mut columns = DMatrix::zeros(10, 12);
            for point in 0..5 {
                for k in 0..4 {
                    columns[(2 * point + k % 2, 2 * point + k / 2)] = values[4 * point + k];
                }
            }
            for k in 0..20 {
                columns[(k % 10, 10 + k / 10)] = values[20 + k];
            }
            let root = ScatterRoot::new(columns.column_iter().map(|c| c.clone_owned()));
            let mut inverse = DMatrix::identity(10, 10);
            let mut transposed = DMatrix::identity(10, 10);
            for k in 0..10 {
                root.apply(inverse.column_mut(k).as_mut_slice());
                root.apply_transposed(transposed.column_mut(k).as_mut_slice());
            }
            let covariance = DMatrix::identity(10, 10) + &columns * columns.transpose();
            let identity = &inverse * &covariance * inverse.transpose();
            let factor = covariance.clone().cholesky().unwrap();
            let dense: f64 = factor.l().diagonal().map(|pivot| 2.0 * pivot.ln()).sum();
            // Rounding, and directions of variance below 1e-9, ten at most.
            prop_assert!((root.log_determinant() - dense).abs() < 1e-7);
            // Rounding: variances to 12 · 9; directions of variance below 1e-9 are left.
            prop_assert!((identity - DMatrix::identity(10, 10)).amax() < 1e-8);
            prop_assert!((transposed - inverse.transpose()).amax() < 1e-12);
        }
    }
}
