//! The part of (RᵀR)⁻¹ that lies in the band.

use super::triangle::BandTriangle;

/// The elements (i, j), |i − j| < width, of (RᵀR)⁻¹, at a cost of n·width².
///
/// Takahashi, Fagan and Chen, "Formation of a sparse bus impedance matrix and its application to
/// short circuit study", Proc. 8th PICA Conf., 1973: row i of the inverse follows from the rows
/// below it, Z_ij = δ_ij / R_ii² − (1/R_ii) Σ_k R_ik Z_kj.
#[derive(Debug, Clone)]
pub struct BandInverse {
    n: usize,
    width: usize,
    values: Vec<f64>,
}

impl BandInverse {
    /// The selected inverse of a triangle; unknowns with a zero diagonal are left out (zero).
    pub fn of(triangle: &BandTriangle) -> Self {
        let (n, width) = (triangle.len(), triangle.width());
        let mut values = vec![0.0; n * width];
        let mut near = Near::below(triangle);
        for i in (0..n).rev() {
            near.up(triangle.band(i));
            values[i * width..(i + 1) * width].copy_from_slice(&near.square[..width]);
        }
        Self { n, width, values }
    }

    /// Element (i, j); zero outside the band, where it is not known.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.min(j), i.max(j));
        if j >= self.n || j - i >= self.width {
            return 0.0;
        }
        self.values[i * self.width + j - i]
    }
}

/// Σ sᵀ(RᵀR)⁻¹s over all places of a stencil s, no longer than the band is wide, along the
/// unknowns: the inverse is used row by row and not kept.
pub fn stencil_trace(triangle: &BandTriangle, stencil: &[f64]) -> f64 {
    let width = triangle.width();
    let mut near = Near::below(triangle);
    let mut trace = 0.0;
    for i in (0..triangle.len()).rev() {
        near.up(triangle.band(i));
        if i + stencil.len() <= triangle.len() {
            for (a, row) in stencil.iter().zip(near.square.chunks_exact(width)) {
                let along: f64 = row.iter().zip(stencil).map(|(z, b)| z * b).sum();
                trace += a * along;
            }
        }
    }
    trace
}

/// The square of the inverse over the unknowns i to i + width − 1, on its way up the band.
struct Near {
    width: usize,
    square: Vec<f64>,
    row: Vec<f64>,
}

impl Near {
    /// Below the last unknown.
    fn below(triangle: &BandTriangle) -> Self {
        let width = triangle.width();
        Self {
            width,
            square: vec![0.0; width * width],
            row: vec![0.0; width],
        }
    }

    /// One unknown up, where the triangle has this row.
    fn up(&mut self, r: &[f64]) {
        let width = self.width;
        let (first, rest) = self.row.split_at_mut(1);
        rest.fill(0.0);
        first[0] = 0.0;
        if r[0] != 0.0 {
            for (factor, below) in r[1..].iter().zip(self.square.chunks_exact(width)) {
                for (sum, z) in rest.iter_mut().zip(below) {
                    *sum -= factor * z;
                }
            }
            let mut coupled = 0.0;
            for (z, factor) in rest.iter_mut().zip(&r[1..]) {
                *z /= r[0];
                coupled += factor * *z;
            }
            first[0] = (1.0 / r[0] - coupled) / r[0];
        }
        for a in (1..width).rev() {
            let above = (a - 1) * width;
            self.square
                .copy_within(above..above + width - 1, a * width + 1);
        }
        for (b, z) in self.row.iter().enumerate() {
            self.square[b] = *z;
            self.square[b * width] = *z;
        }
    }
}
