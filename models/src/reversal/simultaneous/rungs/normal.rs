//! Banded normal equations, and columns beside them.

use errsep_solvers::by_processor;
use nalgebra::DMatrix;

use super::Stretch;
use crate::basis::bspline::Cubic;

/// A diagonal that is left with less than this share of itself is determined by nothing.
pub const DETERMINED: f64 = 1e-10;

/// Banded normal equations, and columns beside them.
pub struct Normal {
    /// Row i: columns i + 1 − width to i, the diagonal last.
    band: Vec<f64>,
    width: usize,
    /// Row by row: the two functions of each channel's line, the readings, the gauge.
    pub beside: Vec<f64>,
    pub columns: usize,
    /// Products of lines and readings among themselves.
    pub corner: DMatrix<f64>,
    /// The least share that a pivot keeps of its diagonal; zero where a coefficient is determined by
    /// nothing.
    pub kept: f64,
}

impl Normal {
    /// So many unknowns in a band of a width, columns beside it, of which `lines` are those of the channels.
    pub fn new(unknowns: usize, width: usize, columns: usize, lines: usize) -> Self {
        Self {
            band: vec![0.0; unknowns * width],
            width,
            beside: vec![0.0; unknowns * columns],
            columns,
            corner: DMatrix::zeros(lines + 1, lines + 1),
            kept: 1.0,
        }
    }

    /// Adds a stretch of a channel with its functions and their places among the coefficients; ξ is
    /// `xi[0]` + `xi[1]`·t.
    pub fn add(
        &mut self,
        stretch: &Stretch,
        (functions, places): (&[Cubic; 8], &[Option<usize>; 8]),
        channel: usize,
        xi: [f64; 2],
        weight: f64,
    ) {
        let m = &stretch.powers;
        let lines = self.corner.nrows() - 1;
        for k in 0..8 {
            let Some(i) = places[k] else { continue };
            let f = &functions[k];
            // Σ f tᵖ.
            let mut with = [0.0; 4];
            for (p, sum) in with.iter_mut().enumerate() {
                let product = f[0] * m[p] + f[1] * m[p + 1] + f[2] * m[p + 2] + f[3] * m[p + 3];
                *sum = weight * product;
            }
            let band = &mut self.band[i * self.width..(i + 1) * self.width];
            for l in 0..8 {
                if let Some(j) = places[l]
                    && j <= i
                {
                    let g = &functions[l];
                    let sum = with[0] * g[0] + with[1] * g[1] + with[2] * g[2] + with[3] * g[3];
                    band[self.width - 1 - (i - j)] += sum;
                }
            }
            let left = &stretch.left;
            let row = &mut self.beside[i * self.columns..(i + 1) * self.columns];
            row[2 * channel] += with[0];
            row[2 * channel + 1] += xi[0] * with[0] + xi[1] * with[1];
            row[lines] +=
                weight * (f[0] * left[0] + f[1] * left[1] + f[2] * left[2] + f[3] * left[3]);
        }
        let (a, b) = (2 * channel, 2 * channel + 1);
        let ones = weight * m[0];
        let along = weight * (xi[0] * m[0] + xi[1] * m[1]);
        let squares =
            weight * (xi[0] * xi[0] * m[0] + 2.0 * xi[0] * xi[1] * m[1] + xi[1] * xi[1] * m[2]);
        self.corner[(a, a)] += ones;
        self.corner[(a, b)] += along;
        self.corner[(b, a)] += along;
        self.corner[(b, b)] += squares;
        let [left, left_along] = [
            weight * stretch.left[0],
            weight * (xi[0] * stretch.left[0] + xi[1] * stretch.left[1]),
        ];
        for (row, value) in [(a, left), (b, left_along)] {
            self.corner[(row, lines)] += value;
            self.corner[(lines, row)] += value;
        }
    }

    /// Brings in L⁻¹ before the columns beside.
    pub fn factorise(&mut self) {
        let mut kept = [1.0];
        let (width, columns) = (self.width, self.columns);
        factorise(&mut self.band, &mut self.beside, width, columns, &mut kept);
        self.kept = kept[0];
    }

    /// L⁻ᵀ before a combination of the columns beside.
    pub fn back(&self, weights: &[f64]) -> Vec<f64> {
        let rows = self.beside.chunks_exact(self.columns);
        let mut x: Vec<f64> = rows
            .map(|row| row.iter().zip(weights).map(|(v, w)| v * w).sum())
            .collect();
        let width = self.width;
        for i in (0..x.len()).rev() {
            let row = &self.band[i * width..(i + 1) * width];
            x[i] /= row[width - 1];
            let own = x[i];
            let reach = (width - 1).min(i);
            for (value, l) in x[i - reach..i].iter_mut().zip(&row[width - 1 - reach..]) {
                *value -= l * own;
            }
        }
        x
    }

    /// Products of the columns beside.
    pub fn gram(&self) -> DMatrix<f64> {
        let n = self.columns;
        let mut gram = DMatrix::zeros(n, n);
        products(&self.beside, n, gram.as_mut_slice());
        gram
    }
}

by_processor! {
    fn factorise(
        band: &mut [f64],
        beside: &mut [f64],
        width: usize,
        columns: usize,
        kept: &mut [f64; 1],
    ) from factorise_generic
}

#[inline(always)]
fn factorise_generic<const FMA: bool>(
    band: &mut [f64],
    beside: &mut [f64],
    width: usize,
    columns: usize,
    kept: &mut [f64; 1],
) {
    let count = band.len() / width;
    for i in 0..count {
        let reach = (width - 1).min(i);
        let (above, rest) = band.split_at_mut(i * width);
        let row = &mut rest[..width];
        let whole = row[width - 1];
        let (done, own) = beside.split_at_mut(i * columns);
        let own = &mut own[..columns];
        for j in i - reach..i {
            let other = &above[j * width..(j + 1) * width];
            // Where column j stands, and so many columns before it that both rows have.
            let at = width - 1 - (i - j);
            let before = &other[width - 1 - at..width - 1];
            let mut l = row[at];
            for (a, b) in row[..at].iter().zip(before) {
                l -= a * b;
            }
            l /= other[width - 1];
            row[at] = l;
            add::<FMA>(own, -l, &done[j * columns..(j + 1) * columns]);
        }
        let squares: f64 = row[..width - 1].iter().map(|l| l * l).sum();
        let pivot = whole - squares;
        if !(pivot > DETERMINED * whole) {
            kept[0] = 0.0;
            return;
        }
        kept[0] = kept[0].min(pivot / whole);
        let root = pivot.sqrt();
        row[width - 1] = root;
        own.iter_mut().for_each(|value| *value /= root);
    }
}

by_processor! {
    fn products(rows: &[f64], n: usize, sums: &mut [f64]) from products_generic
}

#[inline(always)]
fn products_generic<const FMA: bool>(rows: &[f64], n: usize, sums: &mut [f64]) {
    for row in rows.chunks_exact(n) {
        for (a, factor) in row.iter().enumerate() {
            add::<FMA>(&mut sums[a * n..(a + 1) * n], *factor, row);
        }
    }
}

/// Adds a multiple of a row.
#[inline(always)]
fn add<const FMA: bool>(sums: &mut [f64], factor: f64, row: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum = if FMA {
            factor.mul_add(*value, *sum)
        } else {
            *sum + factor * value
        };
    }
}
