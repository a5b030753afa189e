//! Folding rows into a banded triangle by Householder reflections.

use super::lanes::{NEGLIGIBLE_SQUARE, multiply_add};
use super::triangle::BandTriangle;
use crate::by_processor;

/// Rows over a stretch of the band and all dense columns, row by row: what is folded in.
#[derive(Debug, Clone, Default)]
pub struct RowStack {
    first: usize,
    span: usize,
    tail: usize,
    rows: usize,
    values: Vec<f64>,
    work: Vec<f64>,
}

impl RowStack {
    /// Rows of zeros over columns first..first+span and `tail` dense columns.
    pub fn reset(&mut self, first: usize, span: usize, tail: usize, rows: usize) {
        (self.first, self.span, self.tail, self.rows) = (first, span, tail, rows);
        self.values.clear();
        self.values.resize(rows * (span + tail), 0.0);
    }

    /// Row i: `span` values of the band, then the dense columns.
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        let stride = self.span + self.tail;
        &mut self.values[i * stride..(i + 1) * stride]
    }

    /// The dense columns of the rows: after folding, what is left for the border alone.
    pub fn tails(&self) -> impl Iterator<Item = &[f64]> {
        self.values
            .chunks_exact((self.span + self.tail).max(1))
            .map(|row| &row[self.span..])
    }
}

impl BandTriangle {
    /// Columns from `first` that rows folded next must span: rows folded before may reach farther
    /// than the new rows, which then fill in.
    pub fn span_from(&self, first: usize, last: usize) -> usize {
        self.reach.max(last + 1) - first
    }

    /// Folds rows into the triangle: afterwards RᵀR has grown by the rows' own product, and the
    /// band part of the rows is zero. From their
    /// first column to the farthest that any row has touched there may be no more than `width`.
    ///
    /// # Panics
    /// If the rows reach outside the band: the caller promised a width too small.
    pub fn fold(&mut self, rows: &mut RowStack) {
        let end = rows.first + rows.span;
        assert!(
            rows.span <= self.width && end <= self.n && rows.tail == self.tail,
            "rows over columns {}..{end} do not fit a band of {} and width {}",
            rows.first,
            self.n,
            self.width
        );
        self.reach = self.reach.max(end);
        rows.work.clear();
        rows.work.resize(rows.span + rows.tail, 0.0);
        let (first, span, tail) = (rows.first, rows.span, rows.tail);
        eliminate(
            &mut self.values[first * self.stride..end * self.stride],
            self.width,
            &mut rows.values,
            span,
            tail,
            &mut rows.work,
        );
    }
}

by_processor! {
    fn eliminate(
        triangle: &mut [f64],
        width: usize,
        rows: &mut [f64],
        span: usize,
        tail: usize,
        work: &mut [f64],
    ) from eliminate_generic
}

#[inline(always)]
fn eliminate_generic<const FMA: bool>(
    triangle: &mut [f64],
    width: usize,
    rows: &mut [f64],
    span: usize,
    tail: usize,
    work: &mut [f64],
) {
    let stride = span + tail;
    for k in 0..span {
        let below: f64 = rows.chunks_exact(stride).map(|row| row[k] * row[k]).sum();
        if below < NEGLIGIBLE_SQUARE {
            for row in rows.chunks_exact_mut(stride) {
                row[k] = 0.0;
            }
            continue;
        }
        let (band, tails) =
            triangle[k * (width + tail)..(k + 1) * (width + tail)].split_at_mut(width);
        let band = &mut band[..span - k];
        let pivot = band[0];
        let norm = (pivot * pivot + below).sqrt();
        let head = pivot + norm.copysign(pivot);
        let scale = 1.0 / (norm * head.abs());
        // w = scale · vᵀ(R row; rows), first over the band, then over the dense columns.
        let work = &mut work[..stride - k];
        let (work_band, work_tail) = work.split_at_mut(span - k);
        for (w, r) in work_band.iter_mut().zip(band.iter()) {
            *w = head * r;
        }
        for (w, r) in work_tail.iter_mut().zip(tails.iter()) {
            *w = head * r;
        }
        for row in rows.chunks_exact(stride) {
            let v = row[k];
            if v != 0.0 {
                for (w, r) in work.iter_mut().zip(&row[k..]) {
                    *w = multiply_add::<FMA>(v, *r, *w);
                }
            }
        }
        for w in work.iter_mut() {
            *w *= scale;
        }
        let (work_band, work_tail) = work.split_at(span - k);
        for (r, w) in band.iter_mut().zip(work_band) {
            *r = multiply_add::<FMA>(-head, *w, *r);
        }
        for (r, w) in tails.iter_mut().zip(work_tail) {
            *r = multiply_add::<FMA>(-head, *w, *r);
        }
        for row in rows.chunks_exact_mut(stride) {
            let v = row[k];
            if v != 0.0 {
                for (r, w) in row[k..].iter_mut().zip(work.iter()) {
                    *r = multiply_add::<FMA>(-v, *w, *r);
                }
            }
            row[k] = 0.0;
        }
    }
}
