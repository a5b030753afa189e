//! Whether a scatter is that of a noise that was found apart from it.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::DegreesOfFreedom;

/// Probability under noise alone below which something is told.
pub const TOLD_BELOW: f64 = 1e-3;

/// Scatter that is not that of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Disagreement {
    /// Standard deviation of a reading by that scatter, in the unit of the noise.
    pub observed: f64,
    /// Probability that the noise alone makes it as large.
    pub p_value: f64,
}

impl Disagreement {
    /// Tests a sum of squares with its degrees of freedom against a noise of standard deviation `sigma`,
    /// which is known to `degrees`: χ², or F where the noise was estimated. Nothing where the noise alone
    /// shows as much with a probability of [`TOLD_BELOW`] or more, or where no degree of freedom is left.
    pub fn of(squares: f64, freedom: f64, sigma: f64, degrees: DegreesOfFreedom) -> Option<Self> {
        if freedom <= 0.0 {
            return None;
        }
        let p_value = exceeding(squares / (sigma * sigma), freedom, degrees);
        (p_value < TOLD_BELOW).then(|| Self {
            observed: (squares / freedom).sqrt(),
            p_value,
        })
    }
}

/// Probability that a sum of squares in units of a variance known to `degrees` exceeds a value.
pub fn exceeding(value: f64, freedom: f64, degrees: DegreesOfFreedom) -> f64 {
    // Without scatter and without noise nothing is to be compared; beyond the limit all tails are zero,
    // and the laws' own arithmetic would overflow.
    if value.is_nan() {
        return 1.0;
    }
    let value = value.min(1e100);
    let tail = match degrees {
        DegreesOfFreedom::Infinite => ChiSquared::new(freedom).map(|law| law.sf(value)).ok(),
        DegreesOfFreedom::Finite(below) => FisherSnedecor::new(freedom, below)
            .map(|law| law.sf(value / freedom))
            .ok(),
    };
    tail.filter(|p| p.is_finite())
        .map_or(1.0, |p| p.clamp(0.0, 1.0))
}
