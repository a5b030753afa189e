//! Uncertainties of functionals from the triangle of a design.

use super::elimination::Elimination;
use super::groups::Slot;
use nalgebra::DMatrix;

/// The rows of one level of the triangle.
struct Level {
    first: usize,
    /// Upper triangle; one for a column that depends on those before it.
    own: DMatrix<f64>,
    /// Columns of the level that it depends on.
    dependent: Vec<usize>,
    /// Transposed: columns of the next level × own rows.
    next: DMatrix<f64>,
    /// Transposed: columns of the border × own rows.
    border: DMatrix<f64>,
}

/// A root W of the covariance W Wᵀ per unit variance of a reading, level by level.
pub(super) struct HalfCovariance<'a> {
    triangle: &'a Elimination,
    /// W of the border, q × k.
    root: &'a DMatrix<f64>,
    levels: Vec<Level>,
}

impl<'a> HalfCovariance<'a> {
    /// That of an elimination whose border has the half covariance `root`.
    pub(super) fn of(triangle: &'a Elimination, root: &'a DMatrix<f64>) -> Self {
        let levels = triangle.levels().map(|(columns, next)| {
            let own = |i: usize, j: usize| match triangle.entry(i, j) {
                0.0 if i == j => 1.0,
                value => value,
            };
            let (first, r) = (columns.start, columns.len());
            Level {
                first,
                own: DMatrix::from_fn(r, r, |i, j| own(first + i, first + j)),
                dependent: (0..r)
                    .filter(|i| triangle.entry(first + i, first + i) == 0.0)
                    .collect(),
                next: DMatrix::from_fn(next.len(), r, |j, i| {
                    triangle.entry(first + i, next.start + j)
                }),
                border: DMatrix::from_fn(root.nrows(), r, |j, i| {
                    triangle.border_entry(first + i, j)
                }),
            }
        });
        Self {
            levels: levels.collect(),
            triangle,
            root,
        }
    }

    /// W of the border.
    pub(super) const fn root(&self) -> &DMatrix<f64> {
        self.root
    }

    /// For functionals c, m × places, that the readings determine: the squares of the lengths of c W, m,
    /// and their parts in the border, k × m.
    pub(super) fn times(
        &self,
        places: &[usize],
        functionals: &DMatrix<f64>,
    ) -> (Vec<f64>, DMatrix<f64>) {
        let m = functionals.nrows();
        let n = self.triangle.band();
        let starts = |k: usize| {
            let touched = (0..places.len()).filter(|&j| functionals[(k, j)] != 0.0);
            let first = touched.map(|j| match self.triangle.slot(places[j]) {
                (Slot::Group(..), columns) => columns.start,
                (Slot::Border(_), _) => n,
            });
            first.min().unwrap_or(n)
        };
        // Sorted by where they start, so that those begun are always the first.
        let mut order: Vec<(usize, usize)> = (0..m).map(|k| (starts(k), k)).collect();
        order.sort_unstable();
        let (mut band, mut border) = (DMatrix::zeros(n, m), DMatrix::zeros(self.root.nrows(), m));
        for (at, &(_, k)) in order.iter().enumerate() {
            for (j, &place) in places.iter().enumerate() {
                let c = functionals[(k, j)];
                match self.triangle.slot(place) {
                    _ if c == 0.0 => {}
                    (Slot::Border(column), _) => border[(column, at)] = c,
                    (Slot::Group(group, row), columns) => {
                        let seen = self.triangle.seen(group, row);
                        for (column, v) in columns.zip(seen) {
                            band[(column, at)] += c * v;
                        }
                    }
                }
            }
        }
        let mut squares = vec![0.0; m];
        for level in &self.levels {
            let (r, next) = (level.own.ncols(), level.next.nrows());
            let begun = order.partition_point(|o| o.0 < level.first + r);
            let mut z = band.view((level.first, 0), (r, begun)).into_owned();
            level.own.tr_solve_upper_triangular_mut(&mut z);
            for &i in &level.dependent {
                z.row_mut(i).fill(0.0);
            }
            for (square, column) in squares.iter_mut().zip(z.column_iter()) {
                *square += column.norm_squared();
            }
            band.view_mut((level.first + r, 0), (next, begun))
                .gemm(-1.0, &level.next, &z, 1.0);
            border
                .columns_mut(0, begun)
                .gemm(-1.0, &level.border, &z, 1.0);
        }
        let of_border = self.root.transpose() * border;
        let (mut sizes, mut parts) = (vec![0.0; m], DMatrix::zeros(self.root.ncols(), m));
        for (at, &(_, k)) in order.iter().enumerate() {
            let part = of_border.column(at);
            sizes[k] = squares[at] + part.norm_squared();
            parts.set_column(k, &part);
        }
        (sizes, parts)
    }
}
