//! Banded normal equations, and columns beside them.

use errsep_solvers::by_processor;
use nalgebra::DMatrix;

use super::moments::Stretch;
use crate::basis::bspline::Cubic;

/// A diagonal that is left with less than this share of itself is determined by nothing.
pub const DETERMINED: f64 = 1e-10;

/// Banded normal equations, and columns beside them.
pub struct Normal {
    /// Row i: columns i + 1 − width to i, the diagonal last, which is that of L once it is known; as wide
    /// as whole lanes.
    band: Vec<f64>,
    width: usize,
    /// Columns before the diagonal that may differ from zero.
    reach: usize,
    /// Column by column, L below its diagonal.
    lower: Vec<f64>,
    /// Row by row: the two functions of each channel's line, the readings, the gauge, zeros to whole lanes.
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
        let reach = width.saturating_sub(1);
        let width = width.next_multiple_of(LANES);
        let columns = columns.next_multiple_of(LANES);
        Self {
            reach,
            lower: vec![0.0; unknowns * reach],
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
        (functions, places): (&Functions, &[Option<usize>; 8]),
        channel: usize,
        xi: [f64; 2],
        weight: f64,
    ) {
        let m = &stretch.powers;
        let lines = self.corner.nrows() - 1;
        let mut sums = Sums::default();
        multiply(functions, stretch, weight, &mut sums);
        for k in 0..8 {
            let Some(i) = places[k] else { continue };
            let band = &mut self.band[i * self.width..(i + 1) * self.width];
            for (place, sum) in places.iter().zip(&sums.pairs[k]) {
                if let Some(j) = place
                    && *j <= i
                {
                    band[self.width - 1 - (i - j)] += sum;
                }
            }
            let row = &mut self.beside[i * self.columns..(i + 1) * self.columns];
            row[2 * channel] += sums.powers[0][k];
            row[2 * channel + 1] += xi[0] * sums.powers[0][k] + xi[1] * sums.powers[1][k];
            row[lines] += sums.left[k];
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
        factorise(self);
        if self.kept > 0.0 {
            forward(self);
        }
    }

    /// L⁻ᵀ before a combination of the columns beside.
    pub fn back(&self, weights: &[f64]) -> Vec<f64> {
        let rows = self.beside.chunks_exact(self.columns);
        let mut x: Vec<f64> = rows
            .map(|row| row.iter().zip(weights).map(|(v, w)| v * w).sum())
            .collect();
        for j in (0..x.len()).rev() {
            let (own, below) = x[j..].split_at_mut(1);
            let column = &self.lower[j * self.reach..(j + 1) * self.reach];
            let pulled: f64 = column.iter().zip(below).map(|(l, x)| l * *x).sum();
            own[0] = (own[0] - pulled) / self.diagonal(j);
        }
        x
    }

    fn diagonal(&self, i: usize) -> f64 {
        self.band[(i + 1) * self.width - 1]
    }

    /// Products of the columns beside.
    pub fn gram(&self) -> DMatrix<f64> {
        let n = self.columns;
        let mut gram = DMatrix::zeros(n, n);
        products(&self.beside, n, gram.as_mut_slice());
        gram
    }
}

/// The functions of a stretch, power by power of t.
#[derive(Default)]
pub struct Functions([[f64; 8]; 4]);

impl Functions {
    /// Puts one in its place.
    pub fn put(&mut self, k: usize, function: Cubic) {
        for (powers, value) in self.0.iter_mut().zip(function) {
            powers[k] = value;
        }
    }
}

/// Weighted sums over the readings of a stretch.
#[derive(Default)]
struct Sums {
    /// Σ f tᵖ, power by power.
    powers: [[f64; 8]; 4],
    /// Σ f g.
    pairs: [[f64; 8]; 8],
    /// Σ f r₀.
    left: [f64; 8],
}

by_processor! {
    fn multiply(f: &Functions, stretch: &Stretch, weight: f64, sums: &mut Sums) from multiply_generic
}

#[inline(always)]
fn multiply_generic<const FMA: bool>(
    Functions(f): &Functions,
    stretch: &Stretch,
    weight: f64,
    sums: &mut Sums,
) {
    for p in 0..4 {
        for q in 0..4 {
            add::<FMA>(&mut sums.powers[p], weight * stretch.powers[p + q], &f[q]);
        }
        add::<FMA>(&mut sums.left, weight * stretch.left[p], &f[p]);
    }
    for p in 0..4 {
        for (row, with) in sums.pairs.iter_mut().zip(sums.powers[p]) {
            add::<FMA>(row, with, &f[p]);
        }
    }
}

by_processor! {
    /// L in the place of the band.
    fn factorise(normal: &mut Normal) from factorise_generic
}

#[inline(always)]
fn factorise_generic<const FMA: bool>(normal: &mut Normal) {
    let (width, reach) = (normal.width, normal.reach);
    let count = normal.band.len() / width;
    let whole: Vec<f64> = (0..count).map(|i| normal.diagonal(i)).collect();
    // Column j of L below the diagonal, behind zeros: ending at row i, it ends as row i does.
    let mut column = vec![0.0; 2 * width];
    for j in 0..count {
        let pivot = normal.diagonal(j);
        if !(pivot > DETERMINED * whole[j]) {
            normal.kept = 0.0;
            return;
        }
        normal.kept = normal.kept.min(pivot / whole[j]);
        let root = pivot.sqrt();
        let per_root = 1.0 / root;
        let (done, rows) = normal.band.split_at_mut((j + 1) * width);
        done[(j + 1) * width - 1] = root;
        // All of the column first: vectors are not read while parts of them are still being written.
        let lower = &mut normal.lower[j * reach..(j + 1) * reach];
        for ((d, l), row) in lower.iter_mut().enumerate().zip(rows.chunks_exact(width)) {
            *l = per_root * row[width - 2 - d];
            column[width + d] = *l;
        }
        for ((d, l), row) in lower.iter().enumerate().zip(rows.chunks_exact_mut(width)) {
            let behind = width - (d + 1).next_multiple_of(LANES);
            add_lanes::<FMA>(
                &mut row[behind..],
                -l,
                &column[d + 1 + behind..d + 1 + width],
            );
        }
    }
}

by_processor! {
    /// L⁻¹ before the columns beside.
    fn forward(normal: &mut Normal) from forward_generic
}

#[inline(always)]
fn forward_generic<const FMA: bool>(normal: &mut Normal) {
    let (reach, columns) = (normal.reach, normal.columns);
    for i in 0..normal.beside.len() / columns {
        let per_root = 1.0 / normal.diagonal(i);
        let first = i.saturating_sub(reach);
        let (done, own) = normal.beside.split_at_mut(i * columns);
        let done = &done[first * columns..];
        let own = own[..columns].as_chunks_mut::<LANES>().0;
        for (at, own) in (0..).step_by(LANES).zip(own) {
            let mut left = *own;
            for (j, row) in (first..i).zip(done.chunks_exact(columns)) {
                let l = normal.lower[j * reach + i - j - 1];
                if let Some(values) = row[at..].first_chunk() {
                    add::<FMA>(&mut left, -l, values);
                }
            }
            *own = left.map(|value| per_root * value);
        }
    }
}

by_processor! {
    fn products(rows: &[f64], n: usize, sums: &mut [f64]) from products_generic
}

#[inline(always)]
fn products_generic<const FMA: bool>(rows: &[f64], n: usize, sums: &mut [f64]) {
    // A few rows of the sums at a time, which the registers hold.
    const TOGETHER: usize = 4;
    for from in (0..n).step_by(TOGETHER) {
        for at in (0..n).step_by(LANES) {
            let mut own = [[0.0; LANES]; TOGETHER];
            for row in rows.chunks_exact(n) {
                let (Some(factors), Some(values)) = (
                    row[from..].first_chunk::<TOGETHER>(),
                    row[at..].first_chunk(),
                ) else {
                    continue;
                };
                for (own, factor) in own.iter_mut().zip(factors) {
                    add::<FMA>(own, *factor, values);
                }
            }
            for (a, own) in own.iter().enumerate() {
                sums[(from + a) * n + at..][..LANES].copy_from_slice(own);
            }
        }
    }
}

/// Lanes of a row beside the band.
const LANES: usize = 8;

/// Adds a multiple of a row of whole lanes.
#[inline(always)]
fn add_lanes<const FMA: bool>(sums: &mut [f64], factor: f64, row: &[f64]) {
    let lanes = sums.as_chunks_mut::<LANES>().0;
    for (sums, values) in lanes.iter_mut().zip(row.as_chunks::<LANES>().0) {
        add::<FMA>(sums, factor, values);
    }
}

/// Adds a multiple of some values.
#[inline(always)]
fn add<const FMA: bool>(sums: &mut [f64; LANES], factor: f64, values: &[f64; LANES]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum = if FMA {
            factor.mul_add(*value, *sum)
        } else {
            *sum + factor * value
        };
    }
}
