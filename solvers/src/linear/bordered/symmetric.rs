//! A symmetric matrix over the unknowns of band and border.

/// A symmetric matrix whose elements between unknowns of the band lie near its diagonal; those with unknowns of
/// the border may lie anywhere. Unknowns are numbered with the band's before the border's.
///
/// Memory goes by the unknowns of the band times those that each has elements with.
#[derive(Debug, Clone)]
pub struct BorderedSymmetric {
    /// Of each unknown of the band the elements with itself, the next, … as far as there are any.
    band: Vec<Vec<f64>>,
    border: usize,
    /// n rows of q values.
    beside: Vec<f64>,
    /// q rows of q values, on and above the diagonal.
    corner: Vec<f64>,
}

impl BorderedSymmetric {
    /// All zero: n unknowns in the band, q in the border.
    pub fn zeros(band: usize, border: usize) -> Self {
        Self {
            band: vec![Vec::new(); band],
            border,
            beside: vec![0.0; band * border],
            corner: vec![0.0; border * border],
        }
    }

    /// Number of unknowns in the band.
    pub fn band_len(&self) -> usize {
        self.band.len()
    }

    /// The rows of the band from the diagonal on, each as long as it has elements.
    pub(super) fn band_rows(&self) -> &[Vec<f64>] {
        &self.band
    }

    /// Adds to an element, and to that across the diagonal.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (n, q, i, j) = (self.band.len(), self.border, i.min(j), i.max(j));
        if j < n {
            let (row, at) = (&mut self.band[i], j - i);
            if row.len() <= at {
                row.resize(at + 1, 0.0);
            }
            row[at] += value;
        } else if i < n {
            self.beside[i * q + j - n] += value;
        } else {
            self.corner[(i - n) * q + j - n] += value;
        }
    }

    /// The matrix times a vector over all unknowns.
    pub fn times(&self, vector: &[f64]) -> Vec<f64> {
        let (n, q) = (self.band.len(), self.border);
        let (band, border) = vector.split_at(n);
        let mut product = vec![0.0; vector.len()];
        let (of_band, of_border) = product.split_at_mut(n);
        for (i, row) in self.band.iter().enumerate() {
            let mut own = 0.0;
            for (k, value) in row.iter().enumerate() {
                own += value * band[i + k];
                if k > 0 {
                    of_band[i + k] += value * band[i];
                }
            }
            for (j, value) in self.beside[i * q..(i + 1) * q].iter().enumerate() {
                own += value * border[j];
                of_border[j] += value * band[i];
            }
            of_band[i] += own;
        }
        for i in 0..q {
            of_border[i] += self.corner[i * q + i] * border[i];
            for j in i + 1..q {
                let value = self.corner[i * q + j];
                of_border[i] += value * border[j];
                of_border[j] += value * border[i];
            }
        }
        product
    }

    /// vᵀMv.
    pub fn form(&self, vector: &[f64]) -> f64 {
        let product = self.times(vector);
        product.iter().zip(vector).map(|(m, v)| m * v).sum()
    }
}
