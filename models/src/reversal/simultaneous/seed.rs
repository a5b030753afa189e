//! The start: the least-squares line of every channel, and the contrasts of the slopes.

use std::f64::consts::FRAC_PI_4;

use errsep_solvers::linear::limited::svd;
use errsep_solvers::structured::Parameters;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::error::ReversalError;
use super::readings::ChannelReadings;
use super::unknowns::Unknowns;
use crate::units::mm_from_um;

/// Tilt (rad) and offset (µm) of each channel's line.
///
/// # Errors
/// [`ReversalError::OnePosition`] for a channel without a slope, [`ReversalError::TooSteep`] for one
/// beyond 45°.
pub fn lines(channels: &[ChannelReadings]) -> Result<Vec<(f64, f64)>, ReversalError> {
    channels
        .par_iter()
        .map(|c| {
            let (slope, height) = c.line().ok_or(ReversalError::OnePosition {
                channel: c.channel.name(),
                x: c.x.first().copied().unwrap_or(0.0),
            })?;
            let tilt = mm_from_um(slope).atan();
            if tilt.abs() >= FRAC_PI_4 {
                return Err(ReversalError::TooSteep {
                    channel: c.channel.name(),
                    degrees: tilt.to_degrees(),
                });
            }
            Ok((tilt, height))
        })
        .collect()
}

/// The tilts whose channel slopes come nearest to the lines'.
pub fn tilts(unknowns: &Unknowns, lines: &[(f64, f64)]) -> Vec<f64> {
    let count = unknowns.tilt_count();
    let rows = (0..lines.len()).flat_map(|c| unknowns.slope_signs(c).take(count));
    let signs = DMatrix::from_row_iterator(lines.len(), count, rows);
    let slopes = DVector::from_iterator(lines.len(), lines.iter().map(|l| l.0));
    // The signs are those of an orthogonal design with a row or a column left out: always solvable.
    svd(signs, true, true)
        .and_then(|factors| factors.solve(&slopes, 1e-9).ok())
        .map_or_else(|| vec![0.0; count], |t| t.iter().copied().collect())
}

/// The starting point: these tilts, the lines' offsets, forms of zero (the first step finds them:
/// they are linear).
pub fn start(
    unknowns: &Unknowns,
    tilts: &[f64],
    lines: &[(f64, f64)],
    thickness_mm: f64,
) -> Parameters {
    let mut start = Parameters::zeros(unknowns.band_count(), unknowns.border_count());
    start.border[..tilts.len()].copy_from_slice(tilts);
    for (c, (_, height)) in lines.iter().enumerate() {
        start.border[unknowns.offset(c)] = *height;
    }
    if let Some(j) = unknowns.thickness_index() {
        start.border[j] = thickness_mm;
    }
    start
}
