//! What the knots that were chosen cut off the forms.
//!
//! An information criterion takes the number of knots whose predictions are best, and so one at which the detail cut off is
//! not much less than the noise of the forms: bands of the noise alone are too narrow. On twice as many cells as were
//! taken a form differs from itself by the detail that these follow and by more noise. The mean variance of a fit by
//! splines is in proportion to their number of coefficients, so that with c and C of them, straight lines apart,
//!
//! ```text
//!     b² = mean (f_C − f_c)² − (C/c − 1) mean u²
//! ```
//!
//! is the mean square of what is cut off. What a cubic spline cuts off a smooth form falls with c⁻⁸ and the variance grows
//! with c, so that their sum is least where the one is an eighth of the other: no less is taken. Both forms are those of the
//! linear fits by which the knots are chosen.

use crate::basis::bspline::{Cubic, CubicBSpline, horner};
use crate::reversal::simultaneous::Axis;

/// How many times the cells the finer forms have.
pub(super) const TIMES: usize = 2;

/// Least part of the variance that is cut off on average where the knots are best.
const LEAST: f64 = 1.0 / 8.0;

/// Places a cell of the finer forms in which they are compared.
const PLACES: usize = 4;

/// Places in which the variance of a form is asked for at most: under correlated noise each costs a pass over the readings.
const VARIANCES: usize = 32;

/// Forms as splines.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curves {
    /// By form.
    pub bases: Vec<CubicBSpline>,
    /// By form and cell, µm.
    pub cubics: Vec<Vec<Cubic>>,
}

impl Curves {
    fn value(&self, form: usize, at: f64) -> f64 {
        let basis = &self.bases[form];
        let k = basis.cell_of(at);
        let (left, width) = basis.cell(k);
        horner(&self.cubics[form][k], (at - left) / width)
    }
}

/// The polynomials of a spline's cells less a line of this height and slope on the axis.
pub(super) fn less_line(
    basis: &CubicBSpline,
    coefficients: &[f64],
    [height, slope]: [f64; 2],
    axis: Axis,
) -> Vec<Cubic> {
    (0..basis.cell_count())
        .map(|k| {
            let (left, width) = basis.cell(k);
            let mut cubic = basis.cubic(coefficients, k);
            cubic[0] -= height + slope * axis.xi(left);
            cubic[1] -= slope * width / axis.scale;
            cubic
        })
        .collect()
}

/// The forms on the knots that were taken and on finer ones.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FinerForms {
    pub taken: Curves,
    pub finer: Curves,
}

impl FinerForms {
    /// The root mean square, µm, of what the knots cut off a sum of forms on knots alike, each with its weight.
    /// `variance` is that of the sum at a position, µm².
    pub fn cut_off(&self, sum: &[(usize, f64)], variance: impl FnMut(f64) -> f64) -> f64 {
        let Some(&(first, _)) = sum.first() else {
            return 0.0;
        };
        let coefficients = |curves: &Curves| (curves.bases[first].cell_count() + 1) as f64;
        let more = coefficients(&self.finer) / coefficients(&self.taken) - 1.0;
        let of = |curves: &Curves, at: f64| -> f64 {
            sum.iter().map(|(f, w)| w * curves.value(*f, at)).sum()
        };
        let breaks = self.finer.bases[first].breaks();
        let (low, high) = (breaks[0], breaks[breaks.len() - 1]);
        let places = |count: usize| {
            (0..count).map(move |k| low + (high - low) * (k as f64 + 0.5) / count as f64)
        };
        let count = PLACES * (breaks.len() - 1);
        let square = |at| (of(&self.finer, at) - of(&self.taken, at)).powi(2);
        let apart = places(count).map(square).sum::<f64>() / count as f64;
        let few = count.min(VARIANCES);
        let noise = places(few).map(variance).sum::<f64>() / few as f64;
        cut_off(apart, more, noise)
    }
}

/// The root mean square of what knots cut off, from the mean square by which a form on finer ones differs, the part by which
/// these have more unknowns, and the mean variance.
pub(super) fn cut_off(apart: f64, more: f64, noise: f64) -> f64 {
    (apart - more * noise).max(noise * LEAST).sqrt()
}
