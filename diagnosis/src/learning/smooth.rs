//! Smooth curves by their marginal likelihood, where the noise is known.

use std::convert::Infallible;

use errsep_solvers::scalar::least_between;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Values of the curves' size among which the likeliest is bracketed.
const SIZES: usize = 61;
/// Range of the size, ln of its square in units of the noise seen best: from nothing to beyond any gap.
const RANGE: (f64, f64) = (-9.0, 30.0);
/// Part of a mode that must be visible, in variance of the noise, to be told as open.
const OPEN: f64 = 0.03;

/// The posterior of coefficients c = Q z with z ~ N(0, τ²), seen through whitened, projected columns G with
/// unit noise: with GᵀG in the basis Q diagonal γ² and s = Qᵀ Gᵀ e, mean τ² s/(1 + γ²τ²) and variance
/// τ²/(1 + γ²τ²) of each z. The likeliest τ is least in Σ ln(1 + γ²τ²) − τ² s²/(1 + γ²τ²) (Wahba, Ann.
/// Statist. 13 (1985) 1378, with the noise known).
pub(super) struct Smooth {
    /// Q, unknowns × modes.
    modes: DMatrix<f64>,
    /// γ².
    seen: DVector<f64>,
    /// s.
    score: DVector<f64>,
    /// ln τ².
    pub size: f64,
}

impl Smooth {
    /// The likeliest curves. `prior`: coefficients of one standard deviation each.
    pub fn likeliest(
        columns: &DMatrix<f64>,
        residual: &DVector<f64>,
        prior: &DMatrix<f64>,
    ) -> Option<Self> {
        let mut fit = Self::with(columns, residual, prior, 0.0)?;
        let greatest = fit.seen.max();
        if !(greatest > 0.0 && greatest.is_finite()) {
            return None;
        }
        let (low, high) = (RANGE.0 - greatest.ln(), RANGE.1 - greatest.ln());
        let step = (high - low) / (SIZES - 1) as f64;
        let heights = (0..SIZES).map(|k| fit.height(low + step * k as f64));
        let best = heights.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let middle = low + step * best.0 as f64;
        let height = |size: f64| Ok::<f64, Infallible>(fit.height(size));
        let found = least_between(middle - step, middle + step, 1e-6, height);
        fit.size = found.unwrap_or(middle);
        Some(fit)
    }

    /// Curves of a size that is given, ln τ².
    pub fn with(
        columns: &DMatrix<f64>,
        residual: &DVector<f64>,
        prior: &DMatrix<f64>,
        size: f64,
    ) -> Option<Self> {
        let scaled = columns * prior;
        let gram = scaled.tr_mul(&scaled);
        if !gram.iter().all(|v| v.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::new(gram);
        Some(Self {
            score: eigen.eigenvectors.tr_mul(&scaled.tr_mul(residual)),
            modes: prior * eigen.eigenvectors,
            seen: eigen.eigenvalues.map(|v| v.max(0.0)),
            size,
        })
    }

    /// Twice the negative logarithm of the likelihood over that of no curve.
    fn height(&self, size: f64) -> f64 {
        let square = size.exp();
        let of = |(seen, score): (&f64, &f64)| {
            let whole = 1.0 + seen * square;
            whole.ln() - square * score * score / whole
        };
        self.seen.iter().zip(self.score.iter()).map(of).sum()
    }

    /// Variance of each mode.
    fn variance(&self, k: usize) -> f64 {
        let square = self.size.exp();
        square / (1.0 + self.seen[k] * square)
    }

    /// The coefficients.
    pub fn coefficients(&self) -> DVector<f64> {
        let mode = |k: usize, _| self.variance(k) * self.score[k];
        &self.modes * DVector::from_fn(self.seen.len(), mode)
    }

    /// Independent coefficients of one standard deviation each: all, or those that readings see.
    pub fn spread(&self, only_seen: bool) -> DMatrix<f64> {
        let kept =
            (0..self.seen.len()).filter(|k| !only_seen || self.seen[*k] * self.variance(*k) > OPEN);
        let columns: Vec<DVector<f64>> = kept
            .map(|k| self.modes.column(k) * self.variance(k).sqrt())
            .collect();
        if columns.is_empty() {
            DMatrix::zeros(self.modes.nrows(), 0)
        } else {
            DMatrix::from_columns(&columns)
        }
    }
}
