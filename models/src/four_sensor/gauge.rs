//! What the outputs do not determine, and how it is settled.
//!
//! Four changes leave every output as it is:
//!
//! | change of f | of S | of γ | of e |
//! |---|---|---|---|
//! | + a | − a | | |
//! | + b x | − b x | − b | |
//! | + c x² | − c x² | − 2c x | − c pᵢ² |
//! | | | − h | + h pᵢ |
//!
//! The first two only fix axes. The last is a constant of the tilt. The third is a parabola that is
//! physically real and that nobody can read off these outputs: it has to come from elsewhere.

use nalgebra::{DMatrix, DVector, DVectorView, DVectorViewMut};
use serde::{Deserialize, Serialize};

use super::{Geometry, direct};
use crate::units::UM_PER_MM;

/// The straight line from which f is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Line {
    /// Through the first and the last point: f(x₀) = f(x_{N−1}) = 0, equation (11) of Zhao et al.
    #[default]
    EndPoints,
    /// The least-squares line of f.
    LeastSquares,
}

/// Where the parabola comes from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Parabola {
    /// Nowhere: f is taken to have none (no second-degree part in the least-squares sense).
    #[default]
    LeastNorm,
    /// The coefficient of x² in the least-squares parabola of the surface, µm/mm².
    SurfaceCurvature(f64),
    /// The zero-adjustments e2, e3, e4 of the sensors, µm, known from a straight edge or a reversal.
    ZeroAdjustment([f64; 3]),
    /// The slope of the least-squares line of γ over the travel, rad/mm, known from a level or an
    /// autocollimator.
    TiltSlope(f64),
}

impl Parabola {
    /// One sentence on what was assumed.
    pub fn statement(self) -> String {
        match self {
            Self::LeastNorm => {
                "The parabola of surface and straightness, and with it the slope of \
                 the tilt over the travel, is not determined by these outputs: the surface was \
                 taken to have none. State the surface's curvature, the zero-adjustments or the \
                 slope of the tilt if one of them is known."
                    .to_owned()
            }
            Self::SurfaceCurvature(value) => format!(
                "The parabola, which these outputs do not determine, follows from the stated \
                 curvature of the surface, {value:?} µm/mm²."
            ),
            Self::ZeroAdjustment([e2, e3, e4]) => format!(
                "The parabola, which these outputs do not determine, follows from the stated \
                 zero-adjustments {e2}, {e3}, {e4} µm of sensors 2, 3 and 4."
            ),
            Self::TiltSlope(value) => format!(
                "The parabola, which these outputs do not determine, follows from the stated slope \
                 of the tilt, {value:?} rad/mm."
            ),
        }
    }
}

/// The discrete orthogonal parabola over the surface's points and its change of the other unknowns,
/// per unit of x² (1 µm/mm²).
#[derive(Debug, Clone)]
pub(super) struct ParabolaMode {
    /// x² less its own least-squares line, µm per µm/mm², length N.
    pub profile: DVector<f64>,
    norm_squared: f64,
    /// Change of the first slide-free combination of e.
    pub zero: f64,
}

impl ParabolaMode {
    pub(super) fn new(geometry: &Geometry) -> Self {
        let count = geometry.point_count();
        let centre = 0.5 * (count - 1) as f64;
        let mut profile = DVector::from_fn(count, |n, _| {
            ((n as f64 - centre) * geometry.step()).powi(2)
        });
        // About the middle x² has no slope, so its least-squares line is its mean.
        let mean = profile.mean();
        profile.add_scalar_mut(-mean);
        let places = geometry.positions();
        let zero = -geometry
            .slide_free()
            .column(0)
            .dot(&places.component_mul(&places));
        Self {
            norm_squared: profile.norm_squared(),
            profile,
            zero,
        }
    }

    /// The coefficient of x² in the least-squares parabola of a profile, µm/mm².
    pub(super) fn coefficient(&self, surface: DVectorView<'_, f64>) -> f64 {
        self.profile.dot(&surface) / self.norm_squared
    }

    /// Change of the coefficient in µm/mm² that a slope of γ of 1 rad/mm stands for: γ falls by 2c x.
    pub(super) const CURVATURE_PER_TILT_SLOPE: f64 = -UM_PER_MM / 2.0;
}

/// Three conditions on f that single out one of all the surfaces that the outputs allow: no line,
/// no parabola. One column each, N × 3.
pub(super) fn conditions(geometry: &Geometry, line: Line) -> DMatrix<f64> {
    let points = geometry.point_count();
    let mut conditions = DMatrix::zeros(points, 3);
    match line {
        Line::EndPoints => {
            conditions[(0, 0)] = 1.0;
            conditions[(points - 1, 1)] = 1.0;
        }
        Line::LeastSquares => {
            let centre = 0.5 * (points - 1) as f64;
            for n in 0..points {
                conditions[(n, 0)] = 1.0;
                conditions[(n, 1)] = n as f64 - centre;
            }
        }
    }
    conditions.set_column(2, &ParabolaMode::new(geometry).profile);
    for mut column in conditions.column_iter_mut() {
        column.normalize_mut();
    }
    conditions
}

/// An orthonormal basis of the unknowns (f, two combinations of e) that meet the conditions,
/// (N + 2) × (N − 1).
///
/// The penalty acts on the surface less the line that makes it least ([`Penalised::line`]) and less its
/// parabola. Counted from its end points, ‖f‖² would take for granted that both lie near the surface's
/// mean line; an estimate from that has no uncertainty that holds for other surfaces.
///
/// [`Penalised::line`]: super::Penalised::line
pub(super) fn section(geometry: &Geometry, line: Line) -> DMatrix<f64> {
    let points = geometry.point_count();
    let conditions = conditions(geometry, line).resize_horizontally(points, 0.0);
    let basis = conditions.qr().q();
    let zeros = direct::ZERO_UNKNOWNS;
    let mut section = DMatrix::zeros(points + zeros, points - 3 + zeros);
    section
        .view_mut((0, 0), (points, points - 3))
        .copy_from(&basis.columns(3, points - 3));
    for zero in 0..zeros {
        section[(points + zero, points - 3 + zero)] = 1.0;
    }
    section
}

/// Takes the reference line away from a profile.
pub(super) fn remove_line(mut profile: DVectorViewMut<'_, f64>, line: Line) {
    let count = profile.len();
    if count < 2 {
        return;
    }
    let last = (count - 1) as f64;
    let (start, slope) = match line {
        Line::EndPoints => (profile[0], (profile[count - 1] - profile[0]) / last),
        Line::LeastSquares => {
            let centre = 0.5 * last;
            let (mut sum, mut moment, mut inertia) = (0.0, 0.0, 0.0);
            for (n, value) in profile.iter().enumerate() {
                let arm = n as f64 - centre;
                sum += value;
                moment += arm * value;
                inertia += arm * arm;
            }
            let slope = moment / inertia;
            (sum / count as f64 - slope * centre, slope)
        }
    };
    for (n, value) in profile.iter_mut().enumerate() {
        *value -= start + slope * n as f64;
    }
}
