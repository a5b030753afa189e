//! The rungs that were tried, and the best of them.

use super::Squares;
use super::waves::NoiseOfWaves;
use crate::basis::bspline::CubicBSpline;
use crate::reversal::finer_forms::{Curves, FinerForms, TIMES};

/// One rung of the ladder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnotTrial {
    /// Number of cells.
    pub cells: usize,
    /// Number of unknowns of the whole fit.
    pub unknowns: usize,
    /// How much noise the fit takes up, in variances of a reading: of white noise one an unknown.
    pub taken_up: f64,
    /// Root mean square of the weighted residuals over their degrees of freedom, relative to the
    /// first rung's guess of the noise.
    pub noise: f64,
    /// Corrected Akaike criterion.
    pub aicc: f64,
    /// Schwarz's criterion, for white noise.
    pub bic: f64,
    /// Generalised cross-validation score, for white noise.
    pub gcv: f64,
}

pub fn trial(cells: usize, readings: usize, unknowns: usize, squares: f64) -> KnotTrial {
    let (m, p) = (readings as f64, unknowns as f64);
    // Noise-free readings leave rounding only: keep the logarithm finite.
    let log = (squares / m).max(f64::MIN_POSITIVE).ln();
    KnotTrial {
        cells,
        unknowns,
        taken_up: p,
        noise: (squares / (m - p)).sqrt(),
        aicc: m * log + 2.0 * p * m / (m - p - 1.0),
        bic: m * log + p * m.ln(),
        gcv: m * squares / (m - p).powi(2),
    }
}

impl KnotTrial {
    /// The same of noise of a known variance, in the unit of the weighted squares, of which the forms take up so much more than
    /// one an unknown: −2 ln L and the penalty.
    #[must_use]
    pub fn taking_up(self, readings: usize, more: f64, variance: f64) -> Self {
        let (m, p) = (readings as f64, self.unknowns as f64);
        let squares = self.noise * self.noise * (m - p);
        let taken_up = p + more;
        let variance = variance.max(f64::MIN_POSITIVE);
        Self {
            taken_up,
            aicc: m * (variance.ln() - 1.0) + squares / variance + penalty(m, taken_up),
            ..self
        }
    }
}

/// Of m readings of which a fit takes up so much noise, corrected; infinite where it takes up as much as there is.
fn penalty(m: f64, taken_up: f64) -> f64 {
    let left = m - taken_up - 1.0;
    if left > 0.0 {
        2.0 * taken_up * m / left
    } else {
        f64::INFINITY
    }
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
pub struct Climbed {
    readings: usize,
    /// The rungs that were tried.
    pub table: Vec<KnotTrial>,
    /// The place of the best.
    pub(super) best: usize,
    /// By rung.
    pub(super) fits: Vec<RungFit>,
    /// The place of the best for white noise, once knots are chosen by the law of the noise.
    for_white: Option<usize>,
    /// By how much the criterion of the best may be off.
    doubt: f64,
    /// Whether rounding has decided nothing.
    pub(super) clear: bool,
    /// The forms on more cells than the best rung has, where no rung has them.
    pub(super) finer: Option<Curves>,
}

impl Climbed {
    /// No rung as yet, of so many readings.
    pub(super) fn of(readings: usize) -> Self {
        Self {
            readings,
            table: Vec::new(),
            best: 0,
            fits: Vec::new(),
            for_white: None,
            doubt: 0.0,
            clear: true,
            finer: None,
        }
    }

    pub(super) fn add(&mut self, trial: KnotTrial, squares: Squares, fit: RungFit) {
        // m ln RSS moves by m δ/RSS.
        let doubt = self.readings as f64 * squares.rounding / squares.left;
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

    /// The best number of cells.
    pub fn cells(&self) -> usize {
        self.table.get(self.best).map_or(1, |t| t.cells)
    }

    /// Whether a rung finer than the best has at least so many cells.
    pub(super) fn on_cells(&self, cells: usize) -> bool {
        let after = self.table.iter().skip(self.best + 1);
        after.into_iter().any(|t| t.cells >= cells)
    }

    /// Takes the best rung under noise of these waves, where the criterion chose for white noise; says whether it is another one.
    pub fn choose_under(&mut self, forms: usize, waves: &NoiseOfWaves) -> bool {
        let before = self.best;
        let white = match self.for_white {
            Some(white) => white,
            None if self.least(self.table.len()) == Some(before) => before,
            None => return false,
        };
        self.for_white = Some(white);
        for trial in &mut self.table {
            let more = forms as f64 * waves.more(trial.cells);
            *trial = trial.taking_up(self.readings, more, waves.variance());
        }
        // No finer: what the model misses would be taken up.
        self.best = self.least(white + 1).unwrap_or(before);
        if self.best < before && self.on_cells(TIMES * self.cells()) {
            self.finer = None;
        }
        self.best != before
    }

    /// The place of the least criterion of the first rungs.
    fn least(&self, rungs: usize) -> Option<usize> {
        let places = 0..rungs.min(self.table.len());
        places.min_by(|a, b| self.table[*a].aicc.total_cmp(&self.table[*b].aicc))
    }

    /// The step to the minimum of the linear fit on the best rung, where normal equations tell.
    pub fn linear(&mut self) -> Option<LinearStep> {
        self.fits.get_mut(self.best)?.linear.take()
    }

    /// The forms on the best rung, on finer and on coarser ones; `x` are positions of a channel in ascending order, mm.
    pub fn forms(&self, x: &[f64]) -> Option<FinerForms> {
        let cells = self.cells();
        let mut finer = self.finer.clone();
        let after = self.table.iter().zip(&self.fits).skip(self.best + 1);
        for (rung, fit) in after {
            if finer.is_none() && rung.cells >= TIMES * cells {
                finer = Some(fit.curves.clone());
            }
        }
        let ladder = self.fits[..self.best].iter().map(|fit| fit.curves.clone());
        let taken = self.fits.get(self.best)?.curves.clone();
        Some(FinerForms::new(taken, finer?, ladder.collect(), x))
    }
}
