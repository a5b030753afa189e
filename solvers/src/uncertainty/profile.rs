//! Profile-likelihood intervals.
//!
//! With parameter j held at θ and the others fitted, S(θ) = Σ r² rises from its minimum S₀. The
//! signed root τ(θ) = ±√((S(θ) − S₀)/s²) is distributed as t with ν degrees of freedom where the
//! model is linear along the profile, which is far weaker than linear in all parameters (Bates &
//! Watts 1988, 6.1.2). The interval ends where |τ| reaches the quantile.

use std::cell::RefCell;

use super::student_quantile;
use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::bounds::Bounds;
use crate::fit::fit;
use crate::options::Options;
use crate::outcome::{Fit, FitError};
use crate::problem::Problem;
use crate::scalar::{NotFound, root_between};

/// What is known of the residuals' standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ResidualScale {
    /// Residuals are in units of it: s = 1, normal quantiles.
    Known,
    /// It is estimated from the residuals: s² = S₀/ν, quantiles of Student's t.
    #[default]
    Estimated,
}

/// One end of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// The profile reaches the quantile here.
    At(f64),
    /// The parameter's bound is reached first.
    Bound(f64),
    /// The profile stays below the quantile as far as it was followed, to this value: the data
    /// do not limit the parameter on this side.
    Open(f64),
}

impl Limit {
    /// The value, infinite in the direction of `sign` for an open limit.
    pub fn value(self, sign: f64) -> f64 {
        match self {
            Self::At(value) | Self::Bound(value) => value,
            Self::Open(_) => sign * f64::INFINITY,
        }
    }
}

/// A profile-likelihood interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileInterval {
    /// The lower end.
    pub lower: Limit,
    /// The upper end.
    pub upper: Limit,
    /// The quantile that |τ| reaches at both ends.
    pub quantile: f64,
}

impl ProfileInterval {
    /// Whether a value lies inside.
    pub fn contains(&self, value: f64) -> bool {
        self.lower.value(-1.0) <= value && value <= self.upper.value(1.0)
    }
}

/// Standard uncertainties beyond which an end is called open.
const FARTHEST: f64 = 1e4;

/// How closely |τ| must reach the quantile.
const TAU_TOLERANCE: f64 = 1e-6;

/// The interval of parameter `index` at a confidence `level` between 0 and 1, around a fit made
/// with the same problem and options.
///
/// # Errors
/// [`FitError::Setting`] for a level outside 0 to 1, an index without parameter, an undetermined
/// parameter, no degrees of freedom to estimate the residuals from, or a profile that finds a lower
/// minimum than the fit; else what a fit along the profile failed with.
pub fn profile_interval<P: Problem + ?Sized>(
    problem: &P,
    fit: &Fit,
    index: usize,
    level: f64,
    scale: ResidualScale,
    options: &Options,
) -> Result<ProfileInterval, FitError> {
    interval(&problem, fit, index, level, scale, options)
}

/// [`profile_interval`], compiled once for all problems.
fn interval(
    problem: &dyn Problem,
    fit: &Fit,
    index: usize,
    level: f64,
    scale: ResidualScale,
    options: &Options,
) -> Result<ProfileInterval, FitError> {
    let wrong = |setting, value: String, must| {
        Err(FitError::Setting {
            setting,
            value,
            must,
        })
    };
    if !(level > 0.0 && level < 1.0) {
        return wrong("level", level.to_string(), "between 0 and 1");
    }
    if index >= fit.parameters.len() {
        return wrong("index", index.to_string(), "that of a parameter");
    }
    let freedom = fit.degrees_of_freedom();
    let probability = 0.5 * (1.0 + level);
    let (variance, quantile) = match scale {
        ResidualScale::Known => (1.0, normal_quantile(probability)),
        ResidualScale::Estimated => match fit.residual_deviation() {
            Some(s) => (s * s, student_quantile(probability, freedom as f64)),
            None => {
                return wrong(
                    "scale",
                    "estimated".to_string(),
                    "known without degrees of freedom",
                );
            }
        },
    };
    let uncertainty = fit.covariance().standard_uncertainty(index) * variance.sqrt();
    if !(uncertainty > 0.0 && uncertainty.is_finite()) {
        let value = fit.names[index].clone();
        return wrong(
            "index",
            value,
            "that of a parameter which the fit determines",
        );
    }
    let profile = Profile {
        problem,
        fit,
        index,
        variance,
        uncertainty,
        quantile,
        options,
    };
    Ok(ProfileInterval {
        lower: profile.limit(-1.0)?,
        upper: profile.limit(1.0)?,
        quantile,
    })
}

fn normal_quantile(probability: f64) -> f64 {
    Normal::standard().inverse_cdf(probability)
}

struct Profile<'a> {
    problem: &'a dyn Problem,
    fit: &'a Fit,
    index: usize,
    variance: f64,
    uncertainty: f64,
    quantile: f64,
    options: &'a Options,
}

/// A point on the profile: where, the other parameters, and |τ| less the quantile.
struct Place {
    value: f64,
    parameters: DVector<f64>,
    excess: f64,
}

impl Profile<'_> {
    /// Follows the profile in one direction: out until the quantile is passed, then in between.
    fn limit(&self, sign: f64) -> Result<Limit, FitError> {
        let estimate = self.fit.parameters[self.index];
        let bound = self.bound(sign);
        let mut inside = Place {
            value: estimate,
            parameters: self.fit.parameters.clone(),
            excess: -self.quantile,
        };
        let mut reach = self.quantile * self.uncertainty;
        let outside = loop {
            let wanted = estimate + sign * reach;
            let stopped = sign * (wanted - bound) >= 0.0;
            let place = self.place(if stopped { bound } else { wanted }, &inside)?;
            if place.excess >= 0.0 {
                break place;
            }
            if stopped {
                return Ok(Limit::Bound(bound));
            }
            if reach > FARTHEST * self.uncertainty {
                return Ok(Limit::Open(wanted));
            }
            reach *= 1.5;
            inside = place;
        };
        self.between(inside, &outside).map(Limit::At)
    }

    /// Where |τ| reaches the quantile between two places. Each fit begins at the farthest place inside.
    fn between(&self, inside: Place, outside: &Place) -> Result<f64, FitError> {
        let close = TAU_TOLERANCE * self.quantile;
        let (from, to) = (inside.value, outside.value);
        let ends = [(from, inside.excess), (to, outside.excess)];
        let start = RefCell::new(inside);
        let excess = |value: f64| {
            let known = ends.iter().find(|(end, _)| *end == value);
            let found = match known {
                Some((_, excess)) => *excess,
                None => {
                    let place = self.place(value, &start.borrow())?;
                    let found = place.excess;
                    if found < 0.0 {
                        start.replace(place);
                    }
                    found
                }
            };
            // Close enough ends the search.
            Ok(if found.abs() <= close { 0.0 } else { found })
        };
        root_between(from, to, close * self.uncertainty, excess).map_err(|not| match not {
            NotFound::Function(own) => own,
            NotFound::Bracket(reason) => FitError::BrokenOff { reason },
        })
    }

    fn bound(&self, sign: f64) -> f64 {
        let Some(bounds) = &self.options.bounds else {
            return sign * f64::INFINITY;
        };
        if sign < 0.0 {
            bounds.lower()[self.index]
        } else {
            bounds.upper()[self.index]
        }
    }

    /// Fits the other parameters with this one held at `value`.
    fn place(&self, value: f64, from: &Place) -> Result<Place, FitError> {
        let n = self.fit.parameters.len();
        let bounds = self
            .options
            .bounds
            .clone()
            .unwrap_or_else(|| Bounds::none(n));
        let options = Options {
            bounds: Some(bounds.with(self.index, value, value)),
            ..self.options.clone()
        };
        let mut start = from.parameters.clone();
        start[self.index] = value;
        let held = fit(self.problem, start, &options)?;
        let rise = 2.0 * (held.cost - self.fit.cost);
        // Far below the quantile's square, far above the rounding of a cost.
        if rise < -1e-6 * (self.variance + self.fit.cost) {
            return Err(FitError::Setting {
                setting: "fit",
                value: format!("at cost {}", self.fit.cost),
                must: "at its lowest minimum: the profile found a lower one",
            });
        }
        let tau = (rise.max(0.0) / self.variance).sqrt();
        Ok(Place {
            value,
            parameters: held.parameters,
            excess: tau - self.quantile,
        })
    }
}
