//! The part of Z M Z, Z = (RᵀR)⁻¹, that lies in a band.

use super::triangle::BandTriangle;

/// The elements (i, j), |i − j| < width, of Z = (RᵀR)⁻¹ and of Z M Z for a banded symmetric M, at a cost of
/// n·width².
///
/// Z M Z is −dZ where RᵀR changes by M: the recurrences of Cholesky and, for Z, of Takahashi (see
/// [`BandInverse`](super::BandInverse)), differentiated, give it within the band without what lies outside.
#[derive(Debug, Clone)]
pub struct BandSandwich {
    n: usize,
    width: usize,
    inverse: Vec<f64>,
    product: Vec<f64>,
}

impl BandSandwich {
    /// Of a triangle and of the upper triangle of M: row i holds columns i, i+1, … as far as M goes. The band
    /// is as wide as `width`, as R and as M at least; unknowns with a zero diagonal are left out (zero).
    pub fn of(triangle: &BandTriangle, middle: &[Vec<f64>], width: usize) -> Self {
        let n = triangle.len();
        let reach = middle.iter().map(Vec::len).max().unwrap_or(0);
        let width = width.max(reach).max(triangle.width()).min(n.max(1));
        let changes = changes(triangle, middle, width);
        let mut band = Self {
            n,
            width,
            inverse: vec![0.0; n * width],
            product: vec![0.0; n * width],
        };
        for i in (0..n).rev() {
            band.up(i, triangle.band(i), &changes[i * width..(i + 1) * width]);
        }
        band
    }

    /// Row i of both, from the rows below it: of R Z = R⁻ᵀ, R dZ = −R⁻ᵀ dRᵀ R⁻ᵀ − dR Z, on and above the diagonal.
    fn up(&mut self, i: usize, r: &[f64], dr: &[f64]) {
        if r[0] == 0.0 {
            return;
        }
        let (own, count) = (i * self.width, self.width.min(self.n - i));
        for l in (0..count).rev() {
            let (mut of_inverse, mut of_product) = (0.0, 0.0);
            for k in 1..count {
                let at = self.place(i + k, i + l);
                of_product += dr[k] * self.inverse[at];
                if let Some(r) = r.get(k) {
                    of_inverse += r * self.inverse[at];
                    of_product -= r * self.product[at];
                }
            }
            let (ends, bends) = match l {
                0 => (1.0 / r[0], dr[0] / (r[0] * r[0])),
                _ => (0.0, 0.0),
            };
            self.inverse[own + l] = (ends - of_inverse) / r[0];
            self.product[own + l] = (bends + of_product + dr[0] * self.inverse[own + l]) / r[0];
        }
    }

    fn place(&self, i: usize, j: usize) -> usize {
        i.min(j) * self.width + i.abs_diff(j)
    }

    fn within(&self, values: &[f64], i: usize, j: usize) -> f64 {
        if i.max(j) >= self.n || i.abs_diff(j) >= self.width {
            return 0.0;
        }
        values[self.place(i, j)]
    }

    /// Element (i, j) of Z; zero outside the band, where it is not known.
    pub fn inverse(&self, i: usize, j: usize) -> f64 {
        self.within(&self.inverse, i, j)
    }

    /// Element (i, j) of Z M Z; zero outside the band, where it is not known.
    pub fn product(&self, i: usize, j: usize) -> f64 {
        self.within(&self.product, i, j)
    }
}

/// dR where RᵀR changes by M, n rows of `width` values: dRᵀR + RᵀdR = M, row by row.
fn changes(triangle: &BandTriangle, middle: &[Vec<f64>], width: usize) -> Vec<f64> {
    let n = triangle.len();
    let mut changes = vec![0.0; n * width];
    for (row, middle) in changes.chunks_exact_mut(width).zip(middle) {
        row[..middle.len()].copy_from_slice(middle);
    }
    for i in 0..n {
        let r = triangle.band(i);
        let (own, below) = changes[i * width..].split_at_mut(width);
        if r[0] == 0.0 {
            own.fill(0.0);
            continue;
        }
        own[0] /= 2.0 * r[0];
        let (first, rest) = own.split_at_mut(1);
        for (k, change) in rest.iter_mut().enumerate() {
            *change = (*change - first[0] * r.get(k + 1).unwrap_or(&0.0)) / r[0];
        }
        for (k, row) in below.chunks_exact_mut(width).enumerate().take(r.len() - 1) {
            let k = k + 1;
            for (value, change) in row.iter_mut().zip(&own[k..]) {
                *value -= r[k] * change;
            }
            for (value, r) in row.iter_mut().zip(&r[k..]) {
                *value -= own[k] * r;
            }
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::linear::banded::RowStack;

    #[test]
    fn the_band_is_that_of_the_product_written_out() {
        let n = 12;
        let mut triangle = BandTriangle::new(n, 3, 0);
        let mut dense = DMatrix::<f64>::zeros(n, n);
        let mut rows = RowStack::default();
        for k in 0..3 * (n - 2) {
            let (first, phase) = (k / 3, k as f64);
            rows.reset(first, triangle.span_from(first, first + 2), 0, 1);
            let row = [phase.sin(), 1.0 + 0.3 * phase.cos(), (2.0 * phase).sin()];
            rows.row_mut(0)[..3].copy_from_slice(&row);
            triangle.fold(&mut rows);
            for (i, a) in row.iter().enumerate() {
                for (j, b) in row.iter().enumerate() {
                    dense[(first + i, first + j)] += a * b;
                }
            }
        }
        // M is wider than R.
        let element = |i: usize, j: usize| 1.0 + ((i * j) as f64).sin();
        let middle: Vec<Vec<f64>> = (0..n)
            .map(|i| (i..n.min(i + 5)).map(|j| element(i, j)).collect())
            .collect();
        let whole = DMatrix::from_fn(n, n, |i, j| {
            let (i, j) = (i.min(j), i.max(j));
            if j - i < 5 { element(i, j) } else { 0.0 }
        });
        let inverse = dense.try_inverse().unwrap();
        let product = &inverse * whole * &inverse;
        for width in [1, 7, 40] {
            let band = BandSandwich::of(&triangle, &middle, width);
            for i in 0..n {
                for j in 0..n {
                    let known = i.abs_diff(j) < width.max(5);
                    let expect = |m: &DMatrix<f64>| if known { m[(i, j)] } else { 0.0 };
                    // Rounding of matrices whose condition is below 1e3.
                    let (z, p) = (band.inverse(i, j), band.product(i, j));
                    assert!((z - expect(&inverse)).abs() < 1e-11 * inverse.amax());
                    assert!((p - expect(&product)).abs() < 1e-11 * product.amax());
                }
            }
        }
    }
}
