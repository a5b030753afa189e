//! What the knots that were chosen cut off the forms.
//!
//! An information criterion takes the number of knots whose predictions are best, and so one at which the detail cut off is
//! not much less than the noise of the forms: bands of the noise alone are too narrow. What is cut off shows in the fits on
//! other numbers of cells ([`falling`](super::falling)): on coarser ones, how detail grows less from one to the next, and on
//! a finer one, what of it the noise leaves to be seen. All are linear fits, those by which the knots are chosen.

use crate::basis::bspline::{Cubic, CubicBSpline, horner};
use crate::reversal::falling::{Detail, Step};
use crate::reversal::simultaneous::Axis;
use crate::reversal::simultaneous::knots::FEWEST_POSITIONS;

/// How many times the cells the finer forms have.
pub(super) const TIMES: usize = 2;

/// Positions a cell of the finer forms in which they are compared at most.
const PLACES: usize = 4;

/// Places in which the variance of a form is asked for at most: under correlated noise each costs a pass over the readings.
const VARIANCES: usize = 32;

/// Least part of the variance that is cut off on average where the knots are best, of [`cut_off`].
const LEAST: f64 = 1.0 / 8.0;

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

/// The forms on the knots that were taken, on finer and on coarser ones.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FinerForms {
    taken: Curves,
    finer: Curves,
    ladder: Vec<Curves>,
    /// Where they are compared, as parts of the travel: at positions that were read. There the mean variance of a fit is in
    /// proportion to its unknowns; between them splines with nearly as many unknowns as positions swing.
    places: Vec<f64>,
    /// Cells that a spline has at most on the positions.
    carried: usize,
}

impl FinerForms {
    /// The forms on the knots that were taken and on finer ones, and those of the ladder, coarsest first, of which those that
    /// are coarser count; `x` are positions of a channel in ascending order, mm.
    pub fn new(taken: Curves, finer: Curves, ladder: Vec<Curves>, x: &[f64]) -> Self {
        let mut places: Vec<f64> = x.to_vec();
        places.dedup();
        let carried = places.len().saturating_sub(FEWEST_POSITIONS - 1);
        let cells = finer.bases.iter().map(CubicBSpline::cell_count);
        let mut places = thinned(&places, PLACES * cells.max().unwrap_or(1));
        if let (Some(&low), Some(&high)) = (places.first(), places.last()) {
            places
                .iter_mut()
                .for_each(|x| *x = (*x - low) / (high - low));
        }
        Self {
            taken,
            finer,
            ladder,
            places,
            carried,
        }
    }

    /// The root mean square, µm, of what the knots cut off a sum of forms on knots alike, each with its weight.
    /// `variance` is that of the sum at a position, µm².
    pub fn cut_off(&self, sum: &[(usize, f64)], variance: impl FnMut(f64) -> f64) -> f64 {
        let Some(&(first, _)) = sum.first() else {
            return 0.0;
        };
        let cells = |curves: &Curves| curves.bases[first].cell_count();
        let breaks = self.taken.bases[first].breaks();
        let (low, high) = (breaks[0], breaks[cells(&self.taken)]);
        let on_axis = |part: &f64| low + (high - low) * part;
        let of = |curves: &Curves, at: f64| -> f64 {
            sum.iter().map(|(f, w)| w * curves.value(*f, at)).sum()
        };
        let square = |coarse: &Curves, fine: &Curves, at| (of(fine, at) - of(coarse, at)).powi(2);
        let step = |coarse: &Curves, fine: &Curves| Step {
            cells: [cells(coarse), cells(fine)],
            mean_square: mean(self.places.iter().map(on_axis), |at| {
                square(coarse, fine, at)
            }),
        };
        let mut coarser = self.ladder.iter().rev();
        let half = coarser.find(|coarse| TIMES * cells(coarse) <= cells(&self.taken));
        let few = thinned(&self.places, VARIANCES);
        let noise = mean(few.iter().map(on_axis), variance);
        let detail = Detail {
            cut: step(&self.taken, &self.finer),
            seen: half.map(|coarse| step(coarse, &self.taken)),
            carried: self.carried.max(cells(&self.finer)),
            // Straight lines apart a spline has one coefficient more than cells.
            noise: noise / (cells(&self.taken) + 1) as f64,
        };
        detail.cut_off().sqrt()
    }
}

/// At most so many of some places, evenly from first to last.
fn thinned(places: &[f64], most: usize) -> Vec<f64> {
    let (last, count) = (places.len().saturating_sub(1), places.len().min(most));
    (0..count)
        .map(|k| places[k * last / (count - 1).max(1)])
        .collect()
}

fn mean(places: impl ExactSizeIterator<Item = f64>, of: impl FnMut(f64) -> f64) -> f64 {
    let count = places.len().max(1);
    places.map(of).sum::<f64>() / count as f64
}

/// The root mean square of what knots cut off, from the mean square by which a form on finer ones differs, the part by which
/// these have more unknowns, and the mean variance: of a fit on two numbers of cells alone, without a law of its detail. What a
/// cubic spline cuts off a smooth form falls with the eighth power of the cells and the variance grows with them, so that their
/// sum is least where the one is an eighth of the other: no less is taken.
pub(super) fn cut_off(apart: f64, more: f64, noise: f64) -> f64 {
    (apart - more * noise).max(noise * LEAST).sqrt()
}
