//! How large the errors of the staged solution's approximations are, estimated from the data.
//!
//! For a channel of tilt θ whose profile without line is R (µm) on a grid of spacing g (mm):
//!
//! | error | source document | corrected |
//! |---|---|---|
//! | shear | −R θ²/2 | R θ²/2 + R′ (δ + x θ²/2), δ = R θ + h θ |
//! | interpolation | (R θ)²/8 · abs(R″) | linear: d (g − d)/2 · abs(R″); cubic: d (g − d) abs(g − 2d)/6 · abs(R‴) |
//! | thickness | D θ R′ | the same, in the h θ of the shear |
//!
//! (d: how far the rotated points fall from the grid.) The document's shear has the wrong sign and
//! leaves out the sideways shift, which is first order in θ; its interpolation error leaves out that
//! d is measured against the spacing of the grid.

use super::line::Line;
use super::resample::Interpolation;
use super::rotation::angle_of_slope;
use crate::units::mm_from_um;

/// The estimated errors of one channel, µm, at its positions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ErrorEstimates {
    /// Shear instead of rotation, corrected form.
    pub shear: Vec<f64>,
    /// Interpolation back to the grid after rotation, corrected form.
    pub interpolation: Vec<f64>,
    /// The document's shear error.
    pub shear_as_printed: Vec<f64>,
    /// The document's interpolation error.
    pub interpolation_as_printed: Vec<f64>,
    /// Near and far probes on different places of a thick tilted artefact; empty where the
    /// thickness is not known.
    pub thickness: Vec<f64>,
}

impl ErrorEstimates {
    /// Estimates for a trace at `x` whose residuals from `line` are `rest`.
    pub fn of(
        x: &[f64],
        rest: &[f64],
        line: &Line,
        thickness: Option<f64>,
        how: Interpolation,
    ) -> Self {
        let theta = angle_of_slope(line.slope);
        let half = thickness.unwrap_or(0.0) / 2.0;
        let first = slopes(x, rest);
        let second = slopes(x, &first);
        let third = slopes(x, &second);
        let mut all = Self::default();
        for k in 0..x.len() {
            let spacing = spacing(x, k);
            let shift = mm_from_um(rest[k]) * theta + half * theta;
            // The rotation also contracts the axis: u − x = δ + x (1/cosθ − 1), counted from the pivot.
            let aside = shift + x[k] * theta * theta / 2.0;
            let square = theta * theta;
            let d = aside.abs() % spacing;
            all.shear.push(rest[k] * square / 2.0 + first[k] * aside);
            all.interpolation.push(match how {
                Interpolation::Linear => d * (spacing - d) / 2.0 * second[k].abs(),
                Interpolation::Cubic => {
                    d * (spacing - d) * (spacing - 2.0 * d).abs() / 6.0 * third[k].abs()
                }
            });
            all.shear_as_printed.push(-rest[k] * square / 2.0);
            all.interpolation_as_printed
                .push((mm_from_um(rest[k]) * theta).powi(2) / 8.0 * second[k].abs());
            if let Some(thickness) = thickness {
                all.thickness.push(thickness * theta * first[k]);
            }
        }
        all
    }
}

/// Root mean square; zero of nothing.
pub fn rms<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    let (sum, n) = values
        .into_iter()
        .fold((0.0, 0.0), |(sum, n), v| (sum + v * v, n + 1.0));
    if n > 0.0 { f64::sqrt(sum / n) } else { 0.0 }
}

/// Derivative of a profile by differences across its neighbours, per mm.
fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    (0..x.len())
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(x.len() - 1));
            if a == b {
                0.0
            } else {
                (y[b] - y[a]) / (x[b] - x[a])
            }
        })
        .collect()
}

fn spacing(x: &[f64], k: usize) -> f64 {
    let (a, b) = (k.saturating_sub(1), (k + 1).min(x.len() - 1));
    if a == b {
        f64::INFINITY
    } else {
        (x[b] - x[a]) / (b - a) as f64
    }
}
