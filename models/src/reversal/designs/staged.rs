//! The linear solution of a design: lines, slopes and constants by least squares, forms position by
//! position.

use nalgebra::{DMatrix, DVector};

use super::analysis::{self, Analysis};
use super::channel::Design;
use super::determined::{Determined, Zero};
use super::error::DesignFitError;
use super::readings::{DesignObservations, Trace};
use crate::reversal::cells::{Union, cell_width};
use crate::units::mm_from_um;

/// The linear solution.
#[derive(Debug, Clone, PartialEq)]
pub struct Staged {
    /// The fitted slopes, rad, in the order of [`Analysis::pivots`].
    pub slopes: Vec<f64>,
    /// The fitted constants, µm.
    pub constants: Vec<f64>,
    /// Positions at which every channel was read or has a reading on either side, mm.
    pub x: Vec<f64>,
    /// The fitted forms, µm, one row a pivot, without straight-line part over these positions.
    pub forms: Vec<Vec<f64>>,
    /// What the forms leave of the readings, µm, by channel.
    pub residuals: Vec<Vec<f64>>,
}

/// Solves a design in stages, to first order in the tilts: the least-squares line of each channel; slopes
/// and constants from these; at each position the forms from what the lines leave. Where the positions of
/// the channels differ, readings are interpolated linearly to all positions within the common stretch;
/// repeats at a position are averaged.
///
/// # Errors
/// [`DesignFitError`]: a channel without a slope, or no common stretch.
pub fn solve(observations: &DesignObservations, zero: Zero) -> Result<Staged, DesignFitError> {
    let design = &observations.design;
    let traces = Trace::sort(observations);
    lines(design, &traces)?;
    let determined = Determined::of(design, zero);
    let means: Vec<(Vec<f64>, Vec<f64>)> = traces.iter().map(mean_by_position).collect();
    let low = means
        .iter()
        .map(|m| m.0[0])
        .fold(f64::NEG_INFINITY, f64::max);
    let high = means
        .iter()
        .map(|m| m.0[m.0.len() - 1])
        .fold(f64::INFINITY, f64::min);
    let x: Vec<f64> = Union::of(means.iter().map(|m| &m.0[..]))
        .filter(|x| (low..=high).contains(x))
        .collect();
    if x.len() < 3 {
        return Err(DesignFitError::NoOverlap);
    }
    let channels = means.len();
    // Rows: channels; columns: positions.
    let mut rest = DMatrix::from_fn(channels, x.len(), |c, k| at(&means[c], x[k]));
    let widths: Vec<f64> = (0..x.len()).map(|k| cell_width(&x, k)).collect();
    let fitted: Vec<(f64, f64)> = rest
        .row_iter_mut()
        .map(|mut row| {
            let (slope, height) = line_of(&x, &widths, |k| row[k]);
            for (k, value) in row.iter_mut().enumerate() {
                *value -= height + slope * x[k];
            }
            (mm_from_um(slope), height)
        })
        .collect();
    let (slopes, constants) = start(&determined, &fitted);
    let forms = determined.forms.weights() * &rest;
    let seen = determined
        .forms
        .matrix()
        .select_columns(determined.forms.pivots());
    let residuals = rest - seen * &forms;
    let rows = |m: &DMatrix<f64>| m.row_iter().map(|r| r.iter().copied().collect()).collect();
    Ok(Staged {
        slopes,
        constants,
        x,
        forms: rows(&forms),
        residuals: rows(&residuals),
    })
}

/// Tilt (rad) and height (µm) of each channel's line.
///
/// # Errors
/// [`DesignFitError`]: a channel without a reading or without a slope, or one beyond 45°.
pub(super) fn lines(design: &Design, traces: &[Trace]) -> Result<Vec<(f64, f64)>, DesignFitError> {
    traces
        .iter()
        .zip(design.channels())
        .map(|(trace, channel)| {
            let channel = channel.name.clone();
            let Some(first) = trace.x.first() else {
                return Err(DesignFitError::NoReading { channel });
            };
            let Some((slope, height)) = trace.line() else {
                return Err(DesignFitError::OnePosition { channel, x: *first });
            };
            let tilt = mm_from_um(slope).atan();
            if tilt.abs() >= std::f64::consts::FRAC_PI_4 {
                let degrees = tilt.to_degrees();
                return Err(DesignFitError::TooSteep { channel, degrees });
            }
            Ok((tilt, height))
        })
        .collect()
}

/// Slopes and constants that come nearest to the lines (tilt in rad, height in µm at x = 0).
pub(super) fn start(determined: &Determined, lines: &[(f64, f64)]) -> (Vec<f64>, Vec<f64>) {
    let solve = |analysis: &Analysis, values: Vec<f64>| -> Vec<f64> {
        (analysis.weights() * DVector::from_vec(values))
            .iter()
            .copied()
            .collect()
    };
    (
        solve(&determined.slopes, lines.iter().map(|l| l.0).collect()),
        solve(&determined.constants, lines.iter().map(|l| l.1).collect()),
    )
}

/// Whether the channels with a reading somewhere (one flag each) tell all fitted forms apart there.
pub(super) fn tell_apart(forms: &Analysis, seen: &[bool]) -> bool {
    let rows: Vec<usize> = (0..seen.len()).filter(|c| seen[*c]).collect();
    if rows.len() < forms.rank() {
        return false;
    }
    let own = forms.matrix().select_columns(forms.pivots());
    analysis::pivots(&own.select_rows(&rows)).0.len() == forms.rank()
}

/// Positions and mean readings of a trace.
fn mean_by_position(trace: &Trace) -> (Vec<f64>, Vec<f64>) {
    let (mut x, mut value) = (Vec::new(), Vec::new());
    let mut from = 0;
    for place in trace.x.chunk_by(|a, b| a == b) {
        let own = &trace.value[from..from + place.len()];
        x.push(place[0]);
        value.push(own.iter().sum::<f64>() / own.len() as f64);
        from += place.len();
    }
    (x, value)
}

/// The value at a position between or at those of a trace.
fn at((x, value): &(Vec<f64>, Vec<f64>), position: f64) -> f64 {
    let after = x.partition_point(|p| *p < position);
    match (after.checked_sub(1), x.get(after)) {
        (_, Some(p)) if *p == position => value[after],
        (Some(before), Some(p)) => {
            let t = (position - x[before]) / (p - x[before]);
            value[before] + t * (value[after] - value[before])
        }
        (Some(before), None) => value[before],
        (None, _) => value[0],
    }
}

/// Slope and height at zero of the weighted least-squares line.
fn line_of(x: &[f64], widths: &[f64], value: impl Fn(usize) -> f64) -> (f64, f64) {
    let total: f64 = widths.iter().sum();
    let mean = |f: &dyn Fn(usize) -> f64| -> f64 {
        (0..x.len()).map(|k| widths[k] * f(k)).sum::<f64>() / total
    };
    let (center, height) = (mean(&|k| x[k]), mean(&value));
    let spread = mean(&|k| (x[k] - center).powi(2));
    let slope = mean(&|k| (x[k] - center) * (value(k) - height)) / spread;
    (slope, height - slope * center)
}
