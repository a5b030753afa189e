//! Evaluation of type B: what is known other than from repeats (GUM 4.3).

use super::{DegreesOfFreedom, UncertaintyError};

/// Standard uncertainty of a quantity equally likely anywhere within `±half_width` (GUM 4.3.7).
#[must_use]
pub fn rectangular(half_width: f64) -> f64 {
    half_width.abs() / 3.0_f64.sqrt()
}

/// Standard uncertainty of a triangular distribution within `±half_width` (GUM 4.3.9).
#[must_use]
pub fn triangular(half_width: f64) -> f64 {
    half_width.abs() / 6.0_f64.sqrt()
}

/// Standard uncertainty of a quantity that cycles sinusoidally within `±half_width`, as a
/// controlled temperature does (the U-shaped distribution of GUM H.1.3.4).
#[must_use]
pub fn arcsine(half_width: f64) -> f64 {
    half_width.abs() / 2.0_f64.sqrt()
}

/// Degrees of freedom that express how reliable a standard uncertainty is thought to be: `1/2
/// (Δu/u)⁻²` (GUM G.4.2, equation G.3). A relative unreliability of 0 gives infinite ones.
///
/// # Errors
/// A negative number or NaN.
pub fn degrees_from_reliability(
    relative_unreliability: f64,
) -> Result<DegreesOfFreedom, UncertaintyError> {
    if relative_unreliability < 0.0 {
        return Err(UncertaintyError::BadDegreesOfFreedom {
            found: relative_unreliability,
        });
    }
    DegreesOfFreedom::new(0.5 / (relative_unreliability * relative_unreliability))
}
