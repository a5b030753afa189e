//! Many rows over few columns become one small triangle.

use crate::by_processor;

use super::lanes::{LANES, NEGLIGIBLE_SQUARE, add_scaled, dot, dot_four, norm_squared};

/// A batch of rows, column by column: what a model fills and [`compress`] consumes.
///
/// The last column is the residual. Columns are padded with zeros to a multiple of eight rows.
#[derive(Debug, Clone)]
pub struct Tall {
    columns: usize,
    rows: usize,
    values: Vec<f64>,
}

impl Tall {
    /// Most rows in a batch: 128 rows of 16 columns stay in a first-level cache.
    pub const CAPACITY: usize = 128;

    /// An empty batch of a number of columns, the residual included.
    pub fn new(columns: usize) -> Self {
        Self {
            columns,
            rows: 0,
            values: vec![0.0; columns * Self::CAPACITY],
        }
    }

    /// Number of columns, the residual included.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows in use.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Sets the number of rows (at most [`Self::CAPACITY`]) and of columns; values are unspecified
    /// until they are written.
    pub fn reset(&mut self, rows: usize, columns: usize) {
        self.rows = rows.min(Self::CAPACITY);
        self.columns = columns;
        if self.values.len() < columns * Self::CAPACITY {
            self.values.resize(columns * Self::CAPACITY, 0.0);
        }
    }

    /// One column.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.values[j * Self::CAPACITY..j * Self::CAPACITY + self.rows]
    }

    /// One column, to be written.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.values[j * Self::CAPACITY..j * Self::CAPACITY + self.rows]
    }

    /// The first `N` columns at once, to be written in one loop.
    ///
    /// # Panics
    /// If the batch has fewer than `N` columns.
    pub fn first_columns_mut<const N: usize>(&mut self) -> [&mut [f64]; N] {
        assert!(N <= self.columns, "the batch has {} columns", self.columns);
        let rows = self.rows;
        let mut rest = self.values.as_mut_slice();
        std::array::from_fn(|_| {
            let (column, after) = std::mem::take(&mut rest).split_at_mut(Self::CAPACITY);
            rest = after;
            &mut column[..rows]
        })
    }

    fn pad(&mut self) -> usize {
        let padded = self.rows.next_multiple_of(LANES);
        for j in 0..self.columns {
            self.values[j * Self::CAPACITY + self.rows..j * Self::CAPACITY + padded].fill(0.0);
        }
        padded
    }
}

/// Replaces the triangle T (row-major, square, of the batch's column count) by the triangle of
/// the stacked rows (T; batch), by Householder reflections. The batch is destroyed.
pub fn compress(batch: &mut Tall, triangle: &mut [f64]) {
    let rows = batch.pad();
    if rows > 0 {
        stack(&mut batch.values, rows, batch.columns, triangle);
    }
}

by_processor! {
    fn stack(values: &mut [f64], rows: usize, columns: usize, triangle: &mut [f64]) from stack_generic
}

#[inline(always)]
fn stack_generic<const FMA: bool>(
    values: &mut [f64],
    rows: usize,
    columns: usize,
    triangle: &mut [f64],
) {
    const STRIDE: usize = Tall::CAPACITY;
    for k in 0..columns {
        let (done, rest) = values.split_at_mut((k + 1) * STRIDE);
        let v = &done[k * STRIDE..k * STRIDE + rows];
        let below = norm_squared::<FMA>(v);
        if below < NEGLIGIBLE_SQUARE {
            continue;
        }
        let row = &mut triangle[k * columns..(k + 1) * columns];
        let pivot = row[k];
        let norm = (pivot * pivot + below).sqrt();
        let head = pivot + norm.copysign(pivot);
        row[k] = -norm.copysign(pivot);
        // H = I − (1/(‖·‖·|head|)) v vᵀ with v = (head, column).
        let scale = 1.0 / (norm * head.abs());
        let mut j = k + 1;
        while j + 4 <= columns {
            let from = (j - k - 1) * STRIDE;
            let dots = dot_four::<FMA>(v, &rest[from..from + 3 * STRIDE + rows], STRIDE);
            for (l, dot) in dots.into_iter().enumerate() {
                let factor = scale * (head * row[j + l] + dot);
                row[j + l] -= head * factor;
                let start = from + l * STRIDE;
                add_scaled::<FMA>(&mut rest[start..start + rows], -factor, v);
            }
            j += 4;
        }
        while j < columns {
            let start = (j - k - 1) * STRIDE;
            let column = &mut rest[start..start + rows];
            let factor = scale * (head * row[j] + dot::<FMA>(v, column));
            row[j] -= head * factor;
            add_scaled::<FMA>(column, -factor, v);
            j += 1;
        }
    }
}
