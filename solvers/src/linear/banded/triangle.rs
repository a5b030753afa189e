//! Storage of a banded upper triangle with dense columns beside it, and solving with it.

use super::lanes::multiply_add;
use crate::by_processor;

/// An upper triangle R of `n` rows whose row i is nonzero in columns i..i+width only, with `tail`
/// dense columns carried along (border unknowns and the right-hand side).
#[derive(Debug, Clone)]
pub struct BandTriangle {
    pub(super) n: usize,
    pub(super) width: usize,
    pub(super) tail: usize,
    pub(super) stride: usize,
    pub(super) values: Vec<f64>,
    /// One past the last column any folded row has touched.
    pub(super) reach: usize,
}

impl BandTriangle {
    /// An empty triangle: n unknowns, the widest row `width`, `tail` dense columns.
    pub fn new(n: usize, width: usize, tail: usize) -> Self {
        let width = width.max(1);
        let stride = width + tail;
        Self {
            n,
            width,
            tail,
            stride,
            values: vec![0.0; n * stride],
            reach: 0,
        }
    }

    /// Number of unknowns in the band.
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether there is no unknown in the band.
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Columns in a row of the band, the diagonal included.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of dense columns.
    pub fn tail(&self) -> usize {
        self.tail
    }

    /// Row i of the band: columns i, i+1, …, cut at n.
    pub fn band(&self, i: usize) -> &[f64] {
        &self.values[i * self.stride..i * self.stride + self.width.min(self.n - i)]
    }

    /// Row i of the dense columns.
    pub fn tail_row(&self, i: usize) -> &[f64] {
        &self.values[i * self.stride + self.width..(i + 1) * self.stride]
    }

    /// The diagonal element of row i.
    pub fn diagonal(&self, i: usize) -> f64 {
        self.values[i * self.stride]
    }

    /// Unknowns whose diagonal is at most `tolerance` times the norm of their column: the rows do not
    /// determine them beside those before.
    pub fn undetermined(&self, tolerance: f64) -> Vec<usize> {
        let mut squares = vec![0.0; self.n];
        for i in 0..self.n {
            for (sum, r) in squares[i..].iter_mut().zip(self.band(i)) {
                *sum += r * r;
            }
        }
        (0..self.n)
            .filter(|&i| self.diagonal(i).abs() <= tolerance * squares[i].sqrt())
            .collect()
    }

    /// Takes row i out and leaves zeros: its band after the diagonal, then its dense columns.
    pub fn take_row(&mut self, i: usize) -> Vec<f64> {
        let mut row = self.band(i)[1..].to_vec();
        row.extend_from_slice(self.tail_row(i));
        self.values[i * self.stride..(i + 1) * self.stride].fill(0.0);
        row
    }

    /// x ← R⁻¹x. Unknowns with a zero diagonal get zero.
    pub fn solve(&self, x: &mut [f64]) {
        for i in (0..self.n).rev() {
            let row = self.band(i);
            let mut sum = x[i];
            for (r, x) in row[1..].iter().zip(&x[i + 1..]) {
                sum -= r * x;
            }
            x[i] = if row[0] == 0.0 { 0.0 } else { sum / row[0] };
        }
    }

    /// X ← R⁻¹X for X of n rows of `columns` values, row-major. Unknowns with a zero diagonal get zero.
    pub(crate) fn solve_rows(&self, rows: &mut [f64], columns: usize) {
        if columns > 0 {
            solve_rows(self, rows, columns);
        }
    }

    /// x ← R⁻ᵀx. Unknowns with a zero diagonal get zero.
    pub fn solve_transposed(&self, x: &mut [f64]) {
        for i in 0..self.n {
            let row = self.band(i);
            let value = if row[0] == 0.0 { 0.0 } else { x[i] / row[0] };
            x[i] = value;
            if value != 0.0 {
                for (r, x) in row[1..].iter().zip(&mut x[i + 1..]) {
                    *x -= r * value;
                }
            }
        }
    }
}

by_processor! {
    fn solve_rows(triangle: &BandTriangle, rows: &mut [f64], columns: usize) from solve_rows_generic
}

#[inline(always)]
fn solve_rows_generic<const FMA: bool>(triangle: &BandTriangle, rows: &mut [f64], columns: usize) {
    for i in (0..triangle.n).rev() {
        let band = triangle.band(i);
        let (own, below) = rows[i * columns..].split_at_mut(columns);
        if band[0] == 0.0 {
            own.fill(0.0);
            continue;
        }
        for (r, below) in band[1..].iter().zip(below.chunks_exact(columns)) {
            for (x, y) in own.iter_mut().zip(below) {
                *x = multiply_add::<FMA>(-r, *y, *x);
            }
        }
        own.iter_mut().for_each(|x| *x /= band[0]);
    }
}
