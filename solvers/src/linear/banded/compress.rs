//! Many rows over few columns become one small triangle.

use crate::by_processor;

use super::lanes::{LANES, NEGLIGIBLE_SQUARE, multiply_add, norm_squared, sum};

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
            reflect::<FMA, 4>(v, head, scale, &mut row[j..j + 4], &mut rest[from..]);
            j += 4;
        }
        let from = (j - k - 1) * STRIDE;
        let (row, rest) = (&mut row[j..], rest.get_mut(from..).unwrap_or_default());
        match columns - j {
            3 => reflect::<FMA, 3>(v, head, scale, row, rest),
            2 => reflect::<FMA, 2>(v, head, scale, row, rest),
            1 => reflect::<FMA, 1>(v, head, scale, row, rest),
            _ => {}
        }
    }
}

/// Applies a reflection to N columns and their values in the triangle's row.
#[inline(always)]
fn reflect<const FMA: bool, const N: usize>(
    v: &[f64],
    head: f64,
    scale: f64,
    row: &mut [f64],
    columns: &mut [f64],
) {
    let v = v.as_chunks::<LANES>().0;
    let count = v.len();
    let mut rest = columns;
    let columns: [&mut [[f64; LANES]]; N] = std::array::from_fn(|_| {
        let (column, after) = std::mem::take(&mut rest).split_at_mut(Tall::CAPACITY);
        rest = after;
        &mut column.as_chunks_mut::<LANES>().0[..count]
    });
    let mut lanes = [[0.0; LANES]; N];
    for i in 0..count {
        for j in 0..N {
            for l in 0..LANES {
                lanes[j][l] = multiply_add::<FMA>(v[i][l], columns[j][i][l], lanes[j][l]);
            }
        }
    }
    let mut factors = [0.0; N];
    for j in 0..N {
        factors[j] = scale * (head * row[j] + sum(lanes[j]));
        row[j] -= head * factors[j];
    }
    for i in 0..count {
        for j in 0..N {
            for l in 0..LANES {
                columns[j][i][l] = multiply_add::<FMA>(-factors[j], v[i][l], columns[j][i][l]);
            }
        }
    }
}
