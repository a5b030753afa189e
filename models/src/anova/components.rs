//! The components of variance and their confidence intervals.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::{AnovaError, Groups, MeanSquare};
use crate::uncertainty::{DegreesOfFreedom, UncertaintyError};

/// A variance with its confidence interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Estimate, unit of the readings squared. Without bias and therefore negative at times, when
    /// the true component is small.
    pub variance: f64,
    /// Square root of the estimate, zero when that is negative, unit of the readings.
    pub standard_deviation: f64,
    /// Lower end for the variance, not below zero.
    pub lower: f64,
    /// Upper end for the variance.
    pub upper: f64,
    /// Degrees of freedom of the estimate (Satterthwaite's where it is a difference).
    pub degrees: DegreesOfFreedom,
}

/// The two components.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Components {
    /// Coverage of the intervals.
    pub confidence: f64,
    /// From group to group; `None` with one group, or when no group was read twice.
    pub between: Option<Interval>,
    /// Among the readings of one group; `None` when no group was read twice.
    pub within: Option<Interval>,
}

/// `E[MS_w] = σ_w²` and `E[MS_b] = σ_w² + n0 σ_b²` solved for the components.
pub(super) fn components(
    groups: &Groups,
    between: &MeanSquare,
    within: &MeanSquare,
    confidence: f64,
) -> Result<Components, AnovaError> {
    if !(confidence > 0.0 && confidence < 1.0) {
        return Err(UncertaintyError::BadProbability { found: confidence }.into());
    }
    let Some(within_square) = within.mean_square else {
        return Ok(Components {
            confidence,
            between: None,
            within: None,
        });
    };
    let tail = 0.5 * (1.0 - confidence);
    let within_interval = chi_squared_interval(within_square, within.degrees_of_freedom, tail)?;
    let between_interval = match (between.mean_square, groups.effective_replicates()) {
        (Some(square), Some(replicates)) => {
            let variance = (square - within_square) / replicates;
            let (lower, upper) = between_limits(groups, within_square, within, tail)?;
            Some(Interval {
                variance,
                standard_deviation: variance.max(0.0).sqrt(),
                lower,
                upper,
                degrees: difference_degrees(square, between, within_square, within)?,
            })
        }
        _ => None,
    };
    Ok(Components {
        confidence,
        between: between_interval,
        within: Some(within_interval),
    })
}

/// `ν s²/χ²` at both tails, exact for normal readings.
fn chi_squared_interval(square: f64, degrees: usize, tail: f64) -> Result<Interval, AnovaError> {
    let nu = degrees as f64;
    let chi = chi_squared(nu)?;
    Ok(Interval {
        variance: square,
        standard_deviation: square.sqrt(),
        lower: nu * square / chi.inverse_cdf(1.0 - tail),
        upper: nu * square / chi.inverse_cdf(tail),
        degrees: DegreesOfFreedom::new(nu)?,
    })
}

/// Interval of the component between groups of unequal size: the interval of Williams and Tukey
/// for equal sizes, with the sample variance of the group means and their harmonic mean count
/// `h` in the place of the mean square and the common count (J. D. Thomas, R. A. Hultquist,
/// *Annals of Statistics* 6 (1978) 582; R. K. Burdick, F. A. Graybill, *Confidence intervals on
/// variance components*, 1992, section 4.3).
fn between_limits(
    groups: &Groups,
    within_square: f64,
    within: &MeanSquare,
    tail: f64,
) -> Result<(f64, f64), AnovaError> {
    let Some(spread) = groups.spread_of_means() else {
        return Ok((0.0, f64::INFINITY));
    };
    let (nu, h) = (spread.degrees, spread.harmonic_count);
    let within = (within_square, within.degrees_of_freedom as f64);
    limits((h * spread.variance, nu), within, h, tail)
}

/// The interval of Williams and Tukey of a component whose mean square counts it `count` times beside
/// another mean square, both with their degrees of freedom.
pub(super) fn limits(
    (square, nu): (f64, f64),
    (within_square, within_nu): (f64, f64),
    count: f64,
    tail: f64,
) -> Result<(f64, f64), AnovaError> {
    let chi = chi_squared(nu)?;
    let f = FisherSnedecor::new(nu, within_nu)
        .map_err(|_| UncertaintyError::BadDegreesOfFreedom { found: nu })?;
    let limit = |p: f64| {
        let excess = square - within_square * f.inverse_cdf(p);
        (nu * excess / (count * chi.inverse_cdf(p))).max(0.0)
    };
    Ok((limit(1.0 - tail), limit(tail)))
}

/// Satterthwaite's degrees of freedom of the difference of two mean squares; at least one.
pub(super) fn difference_degrees(
    between_square: f64,
    between: &MeanSquare,
    within_square: f64,
    within: &MeanSquare,
) -> Result<DegreesOfFreedom, AnovaError> {
    let difference = between_square - within_square;
    let part = |square: f64, line: &MeanSquare| {
        (square / difference).powi(2) / line.degrees_of_freedom as f64
    };
    let degrees = if difference == 0.0 {
        1.0
    } else {
        1.0 / (part(between_square, between) + part(within_square, within))
    };
    Ok(DegreesOfFreedom::new(degrees.max(1.0))?)
}

pub(super) fn chi_squared(nu: f64) -> Result<ChiSquared, UncertaintyError> {
    ChiSquared::new(nu).map_err(|_| UncertaintyError::BadDegreesOfFreedom { found: nu })
}
