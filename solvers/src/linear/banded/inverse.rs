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
        let mut z = Self {
            n,
            width,
            values: vec![0.0; n * width],
        };
        for i in (0..n).rev() {
            let row = triangle.band(i);
            let diagonal = row[0];
            if diagonal == 0.0 {
                continue;
            }
            for offset in (0..row.len()).rev() {
                let j = i + offset;
                let sum: f64 = (1..row.len()).map(|k| row[k] * z.get(i + k, j)).sum();
                let own = if offset == 0 { 1.0 / diagonal } else { 0.0 };
                z.values[i * width + offset] = (own - sum) / diagonal;
            }
        }
        z
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
