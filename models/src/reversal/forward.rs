//! What an indicator reads: the exact geometry of one channel.
//!
//! The artefact's axis stands at the angle ψ to the slide. A probe at slide position x touches the
//! artefact at the position u on the artefact's own axis with
//!
//! ```text
//!     x       = u cos ψ − (h + S(u)) sin ψ
//!     reading = u sin ψ + (h + S(u)) cos ψ − h + i·M(x) + b
//! ```
//!
//! (h: half the thickness.) By the implicit function theorem, with q = 1/(cos ψ − S′(u) sin ψ),
//!
//! ```text
//!     ∂reading/∂S(u) = q
//!     ∂reading/∂ψ    = x + (sin ψ + S′ cos ψ)(u sin ψ + (h + S) cos ψ) q
//!     ∂reading/∂h    = q − 1
//! ```

use errsep_solvers::problem::NoValue;

/// Beyond this tilt (45°) the indicator no longer sees the artefact in its own direction.
pub const LARGEST_TILT_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// Most Newton steps for the point of contact; two or three are the rule.
const MOST_STEPS: usize = 50;

/// A tilted artefact; lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// The tilt ψ, rad.
    pub tilt_rad: f64,
    /// sin ψ.
    pub sin: f64,
    /// cos ψ.
    pub cos: f64,
    /// 1 − cos ψ, without cancellation.
    pub versed: f64,
    /// Half the thickness h, mm.
    pub half_mm: f64,
}

impl Attitude {
    /// An attitude.
    ///
    /// # Errors
    /// [`NoValue`] beyond 45°, or for a tilt or thickness that is not finite.
    pub fn new(tilt_rad: f64, half_mm: f64) -> Result<Self, NoValue> {
        if !(tilt_rad.abs() <= LARGEST_TILT_RAD) || !half_mm.is_finite() {
            return Err(NoValue::new(format!(
                "a tilt of {tilt_rad:.4} rad with half a thickness of {half_mm} mm: the model holds up to 45°"
            )));
        }
        let (sin, cos) = tilt_rad.sin_cos();
        Ok(Self {
            tilt_rad,
            sin,
            cos,
            versed: 2.0 * (tilt_rad / 2.0).sin().powi(2),
            half_mm,
        })
    }

    /// The slide position at which the point u is touched, where the form is `height_mm`.
    pub fn slide_position(&self, u: f64, height_mm: f64) -> f64 {
        u * self.cos - (self.half_mm + height_mm) * self.sin
    }

    /// What the indicator reads (mm, without M and offset) when it touches u.
    pub fn reading_mm(&self, u: f64, height_mm: f64) -> f64 {
        u * self.sin + height_mm * self.cos - self.half_mm * self.versed
    }

    /// The point touched at slide position x, by Newton's method on a form that gives height (mm)
    /// and slope (mm/mm).
    ///
    /// # Errors
    /// [`NoValue`] where the form is so steep that the probe would touch it in two places.
    pub fn contact(&self, x: f64, mut form: impl FnMut(f64) -> (f64, f64)) -> Result<f64, NoValue> {
        let mut u = (x + self.half_mm * self.sin) / self.cos;
        for _ in 0..MOST_STEPS {
            let (height, slope) = form(u);
            let steepness = self.cos - slope * self.sin;
            if !(steepness > 0.0) {
                break;
            }
            let step = (x - self.slide_position(u, height)) / steepness;
            u += step;
            if step.abs() <= 4.0 * f64::EPSILON * (u.abs() + x.abs() + self.half_mm) {
                return Ok(u);
            }
        }
        Err(no_contact(x))
    }
}

pub(super) fn no_contact(x: f64) -> NoValue {
    NoValue::new(format!(
        "no single point of contact at {x} mm: the form is too steep for this tilt"
    ))
}
