//! The combinations of unknowns that the readings leave open, kept sparse: most of them lie at one
//! position of one axis.

use super::readings::DiagonalError;
use nalgebra::{DMatrix, DVector};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Squared length below which part of an orthonormal null vector counts as none. Null vectors are
/// known to about 1e-11; what a set-up really confounds shows with more than 1e-4.
pub(super) const NOTHING: f64 = 1e-12;

/// A pivot at one position is taken rather than one that all share, which fills in, unless it is below
/// this share of it.
const LOCAL: f64 = 0.01;

/// Columns and values.
pub(super) type SparseRow = Vec<(usize, f64)>;

/// An orthonormal basis of the null space, n × k, row by row.
#[derive(Debug, Clone)]
pub(super) struct Undetermined {
    rows: Vec<SparseRow>,
    columns: usize,
    /// Columns before it lie at one position each.
    shared: usize,
}

impl Undetermined {
    /// The basis for n unknowns of `local` combinations, orthonormal ones over a few places each, and of
    /// `shared` ones, across all local.
    ///
    /// # Errors
    /// [`DiagonalError::Numerical`] if a shared combination is not finite.
    pub(super) fn of<'a>(
        n: usize,
        local: impl Iterator<Item = (&'a [usize], &'a DMatrix<f64>)>,
        shared: &[DVector<f64>],
    ) -> Result<Self, DiagonalError> {
        let mut rows = vec![SparseRow::new(); n];
        let mut columns = 0;
        for (places, basis) in local {
            for (&place, row) in places.iter().zip(basis.row_iter()) {
                rows[place].extend(row.iter().enumerate().map(|(j, v)| (columns + j, *v)));
            }
            columns += basis.ncols();
        }
        let first = columns;
        if !shared.is_empty() {
            if shared.iter().any(|v| !v.iter().all(|x| x.is_finite())) {
                return Err(DiagonalError::Numerical {
                    reason: "what the readings leave open is not finite".to_owned(),
                });
            }
            let basis = DMatrix::from_columns(shared).qr().q();
            for (row, values) in rows.iter_mut().zip(basis.row_iter()) {
                row.extend(values.iter().enumerate().map(|(j, v)| (first + j, *v)));
            }
            columns += basis.ncols();
        }
        Ok(Self {
            rows,
            columns,
            shared: first,
        })
    }

    /// Squared length of the row of an unknown.
    pub(super) fn square(&self, place: usize) -> f64 {
        square(&self.rows[place])
    }

    /// Of one unknown, the squared length of what lies at its position alone, and the rest of its row.
    pub(super) fn split(&self, place: usize) -> (f64, &[(usize, f64)]) {
        let row = &self.rows[place];
        let (local, shared) = row.split_at(row.partition_point(|t| t.0 < self.shared));
        (square(local), shared)
    }

    /// First of the columns that all positions share, and one past the last.
    pub(super) fn shared(&self) -> std::ops::Range<usize> {
        self.shared..self.columns
    }

    /// The combination of unknowns Σ weight · unknown, as a row over the columns.
    pub(super) fn combined(&self, terms: impl IntoIterator<Item = (usize, f64)>) -> SparseRow {
        let mut all: SparseRow = Vec::new();
        for (place, weight) in terms {
            all.extend(self.rows[place].iter().map(|&(j, v)| (j, weight * v)));
        }
        all.sort_by_key(|t| t.0);
        all.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 += next.1;
            }
            same
        });
        all
    }

    /// Nothing held at zero yet.
    pub(super) fn free(&self) -> Held {
        Held {
            pivots: Vec::new(),
            number: vec![None; self.columns],
            work: vec![0.0; self.columns],
            marked: vec![false; self.columns],
            touched: Vec::new(),
            due: BinaryHeap::new(),
            shared: self.shared,
        }
    }
}

pub(super) fn square(row: &[(usize, f64)]) -> f64 {
    row.iter().map(|t| t.1 * t.1).sum()
}

/// Combinations held at zero: their rows in echelon form, each zero in the pivots of those before it.
#[derive(Debug)]
pub(super) struct Held {
    /// The column of each pivot and its row, one in that column.
    pivots: Vec<(usize, SparseRow)>,
    /// Of each column, which pivot it is.
    number: Vec<Option<usize>>,
    /// The row that is being reduced, its columns, and the pivots still to be taken off it.
    work: Vec<f64>,
    marked: Vec<bool>,
    touched: Vec<usize>,
    due: BinaryHeap<Reverse<usize>>,
    shared: usize,
}

impl Held {
    /// How many are held.
    pub(super) fn len(&self) -> usize {
        self.pivots.len()
    }

    /// Lets all go but the first `count`.
    pub(super) fn truncate(&mut self, count: usize) {
        for (column, _) in self.pivots.drain(count..) {
            self.number[column] = None;
        }
    }

    /// Holds these too.
    pub(super) fn add(&mut self, rows: &[SparseRow]) {
        for row in rows {
            let left = self.left_of(row);
            let greatest = |local: bool| {
                let of = left.iter().filter(|t| (t.0 < self.shared) == local);
                let one = of.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
                one.copied().unwrap_or((0, 0.0))
            };
            let (local, shared) = (greatest(true), greatest(false));
            let (column, pivot) = if local.1.abs() > LOCAL * shared.1.abs() {
                local
            } else {
                shared
            };
            if pivot * pivot > NOTHING {
                self.number[column] = Some(self.pivots.len());
                let scaled = left.into_iter().map(|(j, v)| (j, v / pivot)).collect();
                self.pivots.push((column, scaled));
            }
        }
    }

    /// Whether what is still free moves one of these.
    pub(super) fn leaves(&mut self, rows: &[SparseRow]) -> bool {
        rows.iter().any(|row| square(&self.left_of(row)) > NOTHING)
    }

    /// A row less its part among those held.
    fn left_of(&mut self, row: &[(usize, f64)]) -> SparseRow {
        for &(j, v) in row {
            self.touch(j);
            self.work[j] = v;
        }
        while let Some(Reverse(number)) = self.due.pop() {
            let (column, pivot) = std::mem::take(&mut self.pivots[number]);
            let factor = std::mem::take(&mut self.work[column]);
            for &(j, v) in &pivot {
                if j != column {
                    self.touch(j);
                    self.work[j] -= factor * v;
                }
            }
            self.pivots[number] = (column, pivot);
        }
        let (work, marked) = (&mut self.work, &mut self.marked);
        let left = self.touched.drain(..).map(|j| {
            marked[j] = false;
            (j, std::mem::take(&mut work[j]))
        });
        left.filter(|t| t.1 != 0.0).collect()
    }

    fn touch(&mut self, j: usize) {
        if !std::mem::replace(&mut self.marked[j], true) {
            self.touched.push(j);
            self.due.extend(self.number[j].map(Reverse));
        }
    }
}
