//! Taking the tilt out of a trace: by shear, or by the rotation that the set-up really is.

use super::line::Line;
use super::trace::Trace;
use crate::units::{mm_from_um, um_from_mm};

/// How the tilt was taken out of the traces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Removal {
    /// The least-squares line is subtracted.
    Shear,
    /// The points are rotated back and interpolated onto the grid.
    Rotation,
}

impl Removal {
    /// Its name in files and for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Shear => "shear",
            Self::Rotation => "rotation",
        }
    }
}

/// The angle of a slope given in µm/mm, rad.
pub fn angle_of_slope(slope: f64) -> f64 {
    mm_from_um(slope).atan()
}

/// The trace less its line: positions unchanged, residuals in µm.
pub fn sheared(trace: &Trace, line: &Line) -> (Vec<f64>, Vec<f64>) {
    let rest = trace
        .x
        .iter()
        .zip(&trace.mean)
        .map(|(x, y)| y - line.at(*x));
    (trace.x.clone(), rest.collect())
}

/// The trace rotated back by its tilt ψ: positions on the artefact's own axis (mm) and form (µm).
///
/// Exact inverse of x = u cosψ − (h + S) sinψ, reading = u sinψ + (h + S) cosψ − h + b for a trace
/// that holds S only. The surface's mean line stands h from the artefact's axis at right angles,
/// h/cosψ along the indicator: that is what is added to the trace less its intercept before the
/// rotation, and h is subtracted after it. Everything is in mm meanwhile.
pub fn rotated(trace: &Trace, line: &Line, half_thickness: f64) -> (Vec<f64>, Vec<f64>) {
    let (sin, cos) = angle_of_slope(line.slope).sin_cos();
    let h = half_thickness;
    let intercept = line.at(0.0);
    trace
        .x
        .iter()
        .zip(&trace.mean)
        .map(|(&x, &y)| {
            let height = mm_from_um(y - intercept) + h / cos;
            let along = x * cos + height * sin;
            let across = -x * sin + height * cos;
            (along, um_from_mm(across - h))
        })
        .unzip()
}
