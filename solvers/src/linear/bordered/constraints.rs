//! Linear equality constraints between band and border.

use nalgebra::{DMatrix, DVector};

/// p constraints Wᵀc = A y + k between the unknowns c of the band and y of the border.
///
/// W is dense: a constraint may see the whole band (a mean, a least-squares line). It costs p
/// triangular solves a step, never a dense row in the band.
#[derive(Debug, Clone)]
pub struct Constraints {
    /// The columns of W, each of length n.
    pub band: Vec<Vec<f64>>,
    /// A, p × q.
    pub border: DMatrix<f64>,
    /// k, length p.
    pub value: DVector<f64>,
}

impl Constraints {
    /// No constraint, on q border unknowns.
    pub fn none(border: usize) -> Self {
        Self {
            band: Vec::new(),
            border: DMatrix::zeros(0, border),
            value: DVector::zeros(0),
        }
    }

    /// Number of constraints, p.
    pub fn len(&self) -> usize {
        self.band.len()
    }

    /// Whether there is no constraint.
    pub fn is_empty(&self) -> bool {
        self.band.is_empty()
    }

    /// What is missing at a point: A y + k − Wᵀc.
    pub fn missing(&self, band: &[f64], border: &[f64]) -> DVector<f64> {
        let mut missing = &self.border * DVector::from_column_slice(border) + &self.value;
        for (m, w) in missing.iter_mut().zip(&self.band) {
            *m -= w.iter().zip(band).map(|(w, c)| w * c).sum::<f64>();
        }
        missing
    }
}
