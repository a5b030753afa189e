//! Replicates with known components of variance.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{AnovaError, Group, Groups};

/// What the simulated parts and readings are made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Mean of all parts.
    pub mean: f64,
    /// Standard deviation from part to part.
    pub between: f64,
    /// Standard deviation of one reading of one part.
    pub within: f64,
    /// Number of readings of each part in turn.
    pub replicates: Vec<usize>,
}

/// Draws normal parts and readings; the same seed gives the same readings.
///
/// # Errors
/// Spreads that are negative or not finite, no parts, a part without readings.
pub fn simulate(truth: &Truth, seed: u64) -> Result<Groups, AnovaError> {
    for (what, found) in [
        ("the standard deviation between parts", truth.between),
        ("the standard deviation of one reading", truth.within),
    ] {
        if !(found.is_finite() && found >= 0.0) {
            let remedy = "give a finite number that is not negative";
            return Err(AnovaError::BadTruth {
                what,
                found,
                remedy,
            });
        }
    }
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut generator) };
    let groups = truth
        .replicates
        .iter()
        .enumerate()
        .map(|(i, &count)| {
            let centre = truth.mean + truth.between * normal();
            Group {
                name: (i + 1).to_string(),
                readings: (0..count)
                    .map(|_| centre + truth.within * normal())
                    .collect(),
            }
        })
        .collect();
    Groups::new(groups)
}
