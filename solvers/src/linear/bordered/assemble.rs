//! Building the triangle of a bordered band out of groups of rows.

use crate::linear::banded::{BandTriangle, RowStack, Tall, compress};

/// What a local column is to an unknown of the border: ∂r/∂y of a row is the sum of weight·column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The local column, of the band or after it.
    pub column: u32,
    /// The unknown of the border.
    pub unknown: u32,
    /// Its weight.
    pub weight: f64,
}

/// A diagonal of the band at or below this share of its column is rounding.
const BAND_ROUNDING: f64 = 1e-13;

/// A group of rows that see the same unknowns, already compressed to a triangle.
///
/// Columns of the border that are combinations of the local columns cost nothing a row: they are
/// told by `border` alone, whatever their number.
#[derive(Debug, Clone)]
pub struct Group {
    /// For each local band column the unknown it belongs to; `None` where it is fixed at zero.
    pub band: Vec<Option<usize>>,
    /// How local columns make up the columns of the border.
    pub border: Vec<Share>,
    /// Local columns: those of the band, others, the residual.
    pub columns: usize,
    /// The part of the rows it belongs to: parts have weights and degrees of freedom of their own.
    pub part: usize,
    /// The triangle: columns × columns, row-major.
    pub triangle: Vec<f64>,
    /// ½ Σ r² of its rows, or ½ Σ ρ(r²) under a robust loss.
    pub cost: f64,
}

impl Group {
    /// Row i of the triangle.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.triangle[i * self.columns..(i + 1) * self.columns]
    }
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

    /// Folds a group in, its rows times `weight`. From a group's lowest unknown to the highest seen
    /// so far there may be no more than the width of the band; [`Self::finish`] must follow the
    /// last group.
    pub fn absorb(&mut self, group: &Group, weight: f64) {
        let local_band = group.band.len();
        let bounds = group.band.iter().flatten().fold(None, |b, &j| match b {
            None => Some((j, j)),
            Some((low, high)) => Some((j.min(low), j.max(high))),
        });
        let mut stack = std::mem::take(&mut self.stack);
        let (first, span) = match bounds {
            Some((first, last)) => (first, self.triangle.span_from(first, last)),
            None => (0, 0),
        };
        stack.reset(first, span, self.border + 1, local_band);
        for i in 0..local_band {
            let local = group.row(i);
            let out = stack.row_mut(i);
            for (value, unknown) in local.iter().zip(&group.band) {
                if let Some(j) = unknown {
                    out[j - first] += weight * value;
                }
            }
            expand(local, weight, &group.border, &mut out[span..]);
        }
        if span > 0 {
            self.triangle.fold(&mut stack);
        }
        for tail in stack.tails() {
            self.push_border_row(tail);
        }
        stack.reset(0, 0, self.border + 1, 1);
        for i in local_band..group.columns {
            let out = stack.row_mut(0);
            out.fill(0.0);
            expand(group.row(i), weight, &group.border, out);
            self.push_border_row(out);
        }
        self.stack = stack;
    }

    /// Adds a row that sees the border alone: q values and the residual.
    pub fn push_border_row(&mut self, row: &[f64]) {
        if row.iter().all(|v| *v == 0.0) {
            return;
        }
        if self.pending.rows() == Tall::CAPACITY {
            self.bring_in();
        }
        let at = self.pending.rows();
        self.pending.reset(at + 1, self.border + 1);
        for (j, value) in row.iter().enumerate() {
            self.pending.column_mut(j)[at] = *value;
        }
    }

    /// Ends the building: brings rows still waiting into the triangle of the border, and takes out
    /// unknowns of the band that the rows do not determine.
    pub fn finish(&mut self) {
        self.bring_in();
        self.take_out_undetermined();
        self.bring_in();
    }

    /// Where only rounding is left on the diagonal, the rest of the row belongs to the unknowns after
    /// it: it is folded in there, and the diagonal becomes zero, for which a solution gives no step.
    fn take_out_undetermined(&mut self) {
        for i in self.triangle.undetermined(BAND_ROUNDING) {
            let row = self.triangle.take_row(i);
            let (band, tail) = row.split_at(row.len() - self.border - 1);
            if band.iter().all(|r| *r == 0.0) {
                self.push_border_row(tail);
                continue;
            }
            let mut stack = std::mem::take(&mut self.stack);
            stack.reset(i + 1, band.len(), self.border + 1, 1);
            stack.row_mut(0).copy_from_slice(&row);
            self.triangle.fold(&mut stack);
            for tail in stack.tails() {
                self.push_border_row(tail);
            }
            self.stack = stack;
        }
    }

    fn bring_in(&mut self) {
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

/// Adds the border columns of a row of local columns, and its residual.
fn expand(local: &[f64], weight: f64, border: &[Share], out: &mut [f64]) {
    for share in border {
        out[share.unknown as usize] += weight * share.weight * local[share.column as usize];
    }
    if let (Some(out), Some(residual)) = (out.last_mut(), local.last()) {
        *out = weight * residual;
    }
}
