//! Coverage factor and expanded uncertainty (GUM chapter 6 and annex G).

use std::cell::Cell;

use errsep_solvers::uncertainty::student_quantile;
use serde::{Deserialize, Serialize};

use super::{DegreesOfFreedom, Quantity, UncertaintyError};

/// The factor `k` for which `±k u` holds the given share of Student's distribution with these
/// degrees of freedom (GUM G.3.2); of the normal distribution when they are infinite.
///
/// # Errors
/// A probability outside 0..1, or degrees of freedom that are not positive.
pub fn coverage_factor(
    probability: f64,
    degrees_of_freedom: DegreesOfFreedom,
) -> Result<f64, UncertaintyError> {
    if !(probability > 0.0 && probability < 1.0) {
        return Err(UncertaintyError::BadProbability { found: probability });
    }
    let asked = (probability, degrees_of_freedom.as_f64());
    let (last, factor) = LAST.get();
    if last == asked {
        return Ok(factor);
    }
    // From the lower tail, which keeps its digits where the coverage is close to 1.
    let k = -student_quantile(0.5 * (1.0 - probability), asked.1);
    if k.is_nan() {
        return Err(UncertaintyError::BadDegreesOfFreedom { found: asked.1 });
    }
    LAST.set((asked, k));
    Ok(k)
}

thread_local! {
    // The quantities of an answer mostly share their degrees of freedom, and the quantile takes as long as
    // many of them. No probability is zero.
    static LAST: Cell<((f64, f64), f64)> = const { Cell::new(((0.0, 0.0), 0.0)) };
}

/// An expanded uncertainty `U = k u` and its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Expanded {
    /// Share of the distribution that the interval is meant to hold.
    pub coverage_probability: f64,
    /// Coverage factor `k`.
    pub coverage_factor: f64,
    /// Expanded uncertainty `U`, in the unit of the quantity.
    pub expanded_uncertainty: f64,
    /// Lower end `value - U`.
    pub lower: f64,
    /// Upper end `value + U`.
    pub upper: f64,
}

impl Quantity {
    /// Expands to the given coverage probability with Student's factor.
    ///
    /// # Errors
    /// As [`coverage_factor`].
    pub fn expanded(&self, probability: f64) -> Result<Expanded, UncertaintyError> {
        let k = coverage_factor(probability, self.degrees_of_freedom)?;
        let u = k * self.standard_uncertainty;
        Ok(Expanded {
            coverage_probability: probability,
            coverage_factor: k,
            expanded_uncertainty: u,
            lower: self.value - u,
            upper: self.value + u,
        })
    }
}
