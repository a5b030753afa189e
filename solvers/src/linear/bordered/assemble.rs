//! Building the triangle of a bordered band out of groups of rows.

use nalgebra::DMatrix;

use crate::linear::banded::{BandTriangle, RowStack, Tall, compress};

/// A group of rows that see the same unknowns, already compressed to a triangle.
#[derive(Debug, Clone)]
pub struct Group {
    /// For each local band column the unknown it belongs to; `None` where it is fixed at zero.
    pub band: Vec<Option<usize>>,
    /// Which of the border maps turns local border columns into border unknowns.
    pub map: usize,
    /// The triangle: local band columns, local border columns, residual; row-major.
    pub triangle: Vec<f64>,
}

/// The triangle of a banded and bordered least-squares system.
#[derive(Debug, Clone)]
pub struct Bordered {
    pub(super) triangle: BandTriangle,
    pub(super) border: usize,
    /// Upper triangle of the border and the residual, (q+1) × (q+1), row-major.
    pub(super) corner: Vec<f64>,
    pending: Tall,
    stack: RowStack,
}

impl Bordered {
    /// An empty system: n unknowns in a band of a width, q in the border.
    pub fn new(band: usize, width: usize, border: usize) -> Self {
        let columns = border + 1;
        let mut pending = Tall::new(columns);
        pending.reset(0, columns);
        Self {
            triangle: BandTriangle::new(band, width, columns),
            border,
            corner: vec![0.0; columns * columns],
            pending,
            stack: RowStack::default(),
        }
    }

    /// Number of unknowns in the band.
    pub fn band_len(&self) -> usize {
        self.triangle.len()
    }

    /// Number of unknowns in the border.
    pub fn border_len(&self) -> usize {
        self.border
    }

    /// The banded triangle R_cc with R_cy and t_c beside it.
    pub fn triangle(&self) -> &BandTriangle {
        &self.triangle
    }

    /// Folds a group in. From a group's lowest unknown to the highest seen so far there may be
    /// no more than the width of the band; [`Self::finish`] must follow the last group.
    ///
    /// `map` has a row for each local border column and q columns.
    pub fn absorb(&mut self, group: &Group, map: &DMatrix<f64>) {
        let local_band = group.band.len();
        let columns = local_band + map.nrows() + 1;
        let row = |i: usize| &group.triangle[i * columns..(i + 1) * columns];
        let bounds = group.band.iter().flatten().fold(None, |b, &j| match b {
            None => Some((j, j)),
            Some((low, high)) => Some((j.min(low), j.max(high))),
        });
        if let Some((first, last)) = bounds {
            let span = self.triangle.span_from(first, last);
            self.stack.reset(first, span, self.border + 1, local_band);
            for i in 0..local_band {
                let local = row(i);
                let out = self.stack.row_mut(i);
                for (value, unknown) in local.iter().zip(&group.band) {
                    if let Some(j) = unknown {
                        out[j - first] += value;
                    }
                }
                expand(&local[local_band..], map, self.border, &mut out[span..]);
            }
            self.triangle.fold(&mut self.stack);
        } else {
            self.stack.reset(0, 0, self.border + 1, local_band);
            for i in 0..local_band {
                expand(
                    &row(i)[local_band..],
                    map,
                    self.border,
                    self.stack.row_mut(i),
                );
            }
        }
        let mut tails = std::mem::take(&mut self.stack);
        for tail in tails.tails() {
            self.push_border_row(tail);
        }
        tails.reset(0, 0, self.border + 1, 1);
        for i in local_band..columns {
            expand(&row(i)[local_band..], map, self.border, tails.row_mut(0));
            self.push_border_row(tails.row_mut(0));
        }
        self.stack = tails;
    }

    /// Adds a row that sees the border alone: q values and the residual.
    pub fn push_border_row(&mut self, row: &[f64]) {
        if row.iter().all(|v| *v == 0.0) {
            return;
        }
        if self.pending.rows() == Tall::CAPACITY {
            self.finish();
        }
        let at = self.pending.rows();
        self.pending.reset(at + 1, self.border + 1);
        for (j, value) in row.iter().enumerate() {
            self.pending.column_mut(j)[at] = *value;
        }
    }

    /// Brings rows still waiting into the triangle of the border.
    pub fn finish(&mut self) {
        compress(&mut self.pending, &mut self.corner);
        self.pending.reset(0, self.border + 1);
    }

    /// The sum of squares of the residuals of all rows absorbed.
    pub fn sum_of_squares(&self) -> f64 {
        let t = self.residual_parts();
        let rest = self.unreachable_residual();
        t.0.iter().chain(&t.1).map(|v| v * v).sum::<f64>() + rest * rest
    }

    /// t_c and t_y.
    pub(super) fn residual_parts(&self) -> (Vec<f64>, Vec<f64>) {
        let band = (0..self.triangle.len())
            .map(|i| self.triangle.tail_row(i)[self.border])
            .collect();
        let border = (0..self.border)
            .map(|i| self.corner[i * (self.border + 1) + self.border])
            .collect();
        (band, border)
    }

    /// The norm of the part of the residual that no step can change.
    pub fn unreachable_residual(&self) -> f64 {
        self.corner[self.corner.len() - 1].abs()
    }

    /// Element (i, j) of R_yy.
    pub(super) fn corner(&self, i: usize, j: usize) -> f64 {
        self.corner[i * (self.border + 1) + j]
    }

    /// The Euclidean norms of the columns of J, band first.
    pub fn column_norms(&self) -> (Vec<f64>, Vec<f64>) {
        let mut band = vec![0.0; self.triangle.len()];
        let mut border = vec![0.0; self.border];
        for i in 0..self.triangle.len() {
            for (sum, r) in band[i..].iter_mut().zip(self.triangle.band(i)) {
                *sum += r * r;
            }
            for (sum, r) in border.iter_mut().zip(self.triangle.tail_row(i)) {
                *sum += r * r;
            }
        }
        for i in 0..self.border {
            for j in i..self.border {
                border[j] += self.corner(i, j).powi(2);
            }
        }
        (
            band.into_iter().map(f64::sqrt).collect(),
            border.into_iter().map(f64::sqrt).collect(),
        )
    }

    /// The gradient Jᵀr, band first.
    pub fn gradient(&self) -> (Vec<f64>, Vec<f64>) {
        let (t_c, t_y) = self.residual_parts();
        let mut band = vec![0.0; self.triangle.len()];
        let mut border = vec![0.0; self.border];
        for (i, t) in t_c.iter().enumerate() {
            for (sum, r) in band[i..].iter_mut().zip(self.triangle.band(i)) {
                *sum += r * t;
            }
            for (sum, r) in border.iter_mut().zip(self.triangle.tail_row(i)) {
                *sum += r * t;
            }
        }
        for (i, t) in t_y.iter().enumerate() {
            for (j, sum) in border.iter_mut().enumerate().skip(i) {
                *sum += self.corner(i, j) * t;
            }
        }
        (band, border)
    }

    /// A copy with a row √λ·scale for every unknown: the damped system of Levenberg and Marquardt.
    pub fn damped(&self, lambda: f64, band_scale: &[f64], border_scale: &[f64]) -> Self {
        let mut damped = Self {
            triangle: BandTriangle::new(
                self.triangle.len(),
                self.triangle.width(),
                self.border + 1,
            ),
            ..self.clone()
        };
        let root = lambda.sqrt();
        let width = self.triangle.width();
        let mut tails = Vec::new();
        for i in 0..self.triangle.len() {
            let row = self.triangle.band(i);
            let span = damped.triangle.span_from(i, i + row.len() - 1);
            damped.stack.reset(i, span, self.border + 1, 2);
            let out = damped.stack.row_mut(0);
            out[..row.len()].copy_from_slice(row);
            out[span..].copy_from_slice(self.triangle.tail_row(i));
            damped.stack.row_mut(1)[0] = root * band_scale[i];
            debug_assert!(span <= width);
            damped.triangle.fold(&mut damped.stack);
            tails.clear();
            tails.extend(damped.stack.tails().map(<[f64]>::to_vec));
            for tail in &tails {
                damped.push_border_row(tail);
            }
        }
        for (j, scale) in border_scale.iter().enumerate() {
            let mut row = vec![0.0; self.border + 1];
            row[j] = root * scale;
            damped.push_border_row(&row);
        }
        damped.finish();
        damped
    }
}

/// The border columns of a row, from its local columns.
fn expand(local: &[f64], map: &DMatrix<f64>, border: usize, out: &mut [f64]) {
    out.fill(0.0);
    for (l, value) in local[..map.nrows()].iter().enumerate() {
        for (j, out) in out[..border].iter_mut().enumerate() {
            *out += value * map[(l, j)];
        }
    }
    out[border] = local[map.nrows()];
}
