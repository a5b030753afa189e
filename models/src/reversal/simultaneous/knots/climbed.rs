//! The rungs that were tried, and the best of them.

use super::Squares;
use crate::basis::bspline::CubicBSpline;
use crate::reversal::finer_forms::{Curves, FinerForms, TIMES};

/// One rung of the ladder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnotTrial {
    /// Number of cells.
    pub cells: usize,
    /// Number of unknowns of the whole fit.
    pub unknowns: usize,
    /// Root mean square of the weighted residuals over their degrees of freedom, relative to the
    /// first rung's guess of the noise.
    pub noise: f64,
    /// Corrected Akaike criterion.
    pub aicc: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// Generalised cross-validation score.
    pub gcv: f64,
}

pub fn trial(cells: usize, readings: usize, unknowns: usize, squares: f64) -> KnotTrial {
    let (m, p) = (readings as f64, unknowns as f64);
    // Noise-free readings leave rounding only: keep the logarithm finite.
    let log = (squares / m).max(f64::MIN_POSITIVE).ln();
    KnotTrial {
        cells,
        unknowns,
        noise: (squares / (m - p)).sqrt(),
        aicc: m * log + 2.0 * p * m / (m - p - 1.0),
        bic: m * log + p * m.ln(),
        gcv: m * squares / (m - p).powi(2),
    }
}

/// What the ladder says.
pub struct Chosen {
    /// The best number of cells.
    pub cells: usize,
    /// Its rungs.
    pub table: Vec<KnotTrial>,
    /// The linear fit of the best of them, where normal equations tell.
    pub linear: Option<LinearStep>,
    /// The forms there and on finer knots, where there are.
    pub forms: Option<FinerForms>,
}

/// The steps of band and border from where a fit begins to the minimum of its linear model.
#[derive(Debug)]
pub struct LinearStep {
    pub step: (Vec<f64>, Vec<f64>),
    /// On these bases.
    pub bases: Vec<CubicBSpline>,
}

/// What was found on a rung beside its squares.
#[derive(Debug)]
pub(super) struct RungFit {
    pub(super) curves: Curves,
    /// The step there, where normal equations tell.
    pub(super) linear: Option<LinearStep>,
}

/// The rungs that were tried.
#[derive(Debug)]
pub(super) struct Climbed {
    pub(super) table: Vec<KnotTrial>,
    /// The place of the best.
    pub(super) best: usize,
    /// By rung.
    pub(super) fits: Vec<RungFit>,
    /// By how much the criterion of the best may be off.
    doubt: f64,
    /// Whether rounding has decided nothing.
    pub(super) clear: bool,
    /// The forms on more cells than the best rung has, where no rung has them.
    pub(super) finer: Option<Curves>,
}

impl Default for Climbed {
    fn default() -> Self {
        Self {
            table: Vec::new(),
            best: 0,
            fits: Vec::new(),
            doubt: 0.0,
            clear: true,
            finer: None,
        }
    }
}

impl Climbed {
    pub(super) fn add(
        &mut self,
        trial: KnotTrial,
        readings: usize,
        squares: Squares,
        fit: RungFit,
    ) {
        // m ln RSS moves by m δ/RSS.
        let doubt = readings as f64 * squares.rounding / squares.left;
        let is_best = match self.table.get(self.best) {
            None => true,
            Some(best) => {
                let ahead = best.aicc - trial.aicc;
                self.clear &= squares.rounding <= 0.0 || ahead.abs() > doubt + self.doubt;
                ahead > 0.0
            }
        };
        if is_best {
            (self.best, self.doubt) = (self.table.len(), doubt);
        }
        self.push(trial, fit);
    }

    pub(super) fn push(&mut self, trial: KnotTrial, fit: RungFit) {
        self.table.push(trial);
        self.fits.push(fit);
    }

    pub(super) fn cells(&self) -> usize {
        self.table.get(self.best).map_or(1, |t| t.cells)
    }

    /// Whether a rung finer than the best has at least so many cells.
    pub(super) fn on_cells(&self, cells: usize) -> bool {
        let after = self.table.iter().skip(self.best + 1);
        after.into_iter().any(|t| t.cells >= cells)
    }

    /// The best rung and what stands beside it.
    /// The choice; `x` are positions of a channel in ascending order, mm.
    pub(super) fn chosen(self, x: &[f64]) -> Chosen {
        let cells = self.cells();
        let (mut taken, mut linear, mut finer) = (None, None, self.finer);
        let mut ladder = Vec::new();
        for (place, (rung, fit)) in self.table.iter().zip(self.fits).enumerate() {
            if place < self.best {
                ladder.push(fit.curves);
            } else if place == self.best {
                (taken, linear) = (Some(fit.curves), fit.linear);
            } else if finer.is_none() && rung.cells >= TIMES * cells {
                finer = Some(fit.curves);
            }
        }
        let forms = taken
            .zip(finer)
            .map(|(taken, finer)| FinerForms::new(taken, finer, ladder, x));
        Chosen {
            cells,
            table: self.table,
            linear,
            forms,
        }
    }
}
