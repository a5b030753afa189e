//! What a stylus loses beside the crest of a bar.
//!
//! A stylus of radius r beside the crest of a bar of radius R by d stands lower by
//!
//! ```text
//!     ρ − √(ρ² − d²),  ρ = R + r        (d²/2ρ to first order)
//!     d(x) = d₀ + α·t(φ)(x − x̄) + γ·t(ψ)(x − x̄) + M(x)·t(φ),  t(a) = (−sin a, cos a)
//! ```
//!
//! x̄ the middle of the travel, d₀ of each indicator stated there. With zeros that are kept the eccentricity of
//! the bar there, (e + γ x̄)·t(ψ), is found and added. The line of a form is part of its slope.

use errsep_solvers::problem::NoValue;

use crate::reversal::designs::layout::Layout;
use crate::units::{UM_PER_MM, mm_from_um};

/// Stylus and crest of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct CrestTerm {
    /// Radius of the stylus, mm.
    pub tip_mm: f64,
    /// By channel: how far the axis of the bar stands beside the stylus at the middle of the travel, mm.
    pub offset_mm: Vec<f64>,
    /// Middle of the travel, mm.
    pub middle: f64,
    /// Whether the eccentricity is among the constants.
    pub kept: bool,
}

/// How the bar stands beside the stylus of a channel at a point, and what that costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// ρ, mm.
    radius: f64,
    /// d at the middle of the travel without forms, mm.
    shift: f64,
    /// Its slope along the travel, rad.
    slope: f64,
    /// Middle of the travel, mm.
    middle: f64,
}

/// The loss of a reading and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// µm.
    pub um: f64,
    /// Derivative of the reading by d, µm/mm.
    pub per_across: f64,
    /// Derivative of the reading by ρ, µm/mm.
    pub per_radius: f64,
}

impl CrestTerm {
    /// A channel at a point.
    ///
    /// # Errors
    /// [`NoValue`] for a bar without radius.
    pub fn beside(
        &self,
        layout: &Layout,
        channel: usize,
        half_mm: f64,
        border: &[f64],
    ) -> Result<Beside, NoValue> {
        let radius = half_mm + self.tip_mm;
        if !(radius > 0.0) {
            let text = format!(
                "a bar of {half_mm} mm radius with a stylus of {} mm",
                self.tip_mm
            );
            return Err(NoValue::new(text));
        }
        let across = &layout.across[channel];
        let sum = |shares: &[f64], values: &[f64]| -> f64 {
            shares.iter().zip(values).map(|(s, v)| s * v).sum()
        };
        let mut shift = self.offset_mm[channel];
        if self.kept {
            shift += mm_from_um(sum(&across.constants, &border[layout.constants_from()..]));
            shift += self.middle * sum(&across.artefact, border);
        }
        Ok(Beside {
            radius,
            shift,
            slope: sum(&across.slopes, border),
            middle: self.middle,
        })
    }
}

impl Beside {
    /// What is lost at a slide position (mm) where the forms of the slide move the bar across by so much,
    /// µm.
    ///
    /// # Errors
    /// [`NoValue`] where the stylus stands beside the bar.
    pub fn loss(&self, x: f64, wander_um: f64) -> Result<Loss, NoValue> {
        let rho = self.radius;
        let d = self.shift + self.slope * self.lever(x) + mm_from_um(wander_um);
        if !(d.abs() < rho) {
            return Err(NoValue::new(format!(
                "at {x} mm the stylus stands {d:.3} mm beside the crest, and bar and stylus together have a radius \
                 of {rho} mm"
            )));
        }
        let root = ((rho - d) * (rho + d)).sqrt();
        Ok(Loss {
            um: UM_PER_MM * d * d / (rho + root),
            per_across: -UM_PER_MM * d / root,
            per_radius: UM_PER_MM * d * d / (root * (rho + root)),
        })
    }

    /// The distance from the middle of the travel, mm.
    pub fn lever(&self, x: f64) -> f64 {
        x - self.middle
    }
}
