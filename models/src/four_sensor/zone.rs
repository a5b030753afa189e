//! The minimum-zone straightness of S, which no line of the surface changes, with its uncertainty.

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::FourSensorError;
use crate::straightness::{ReferenceLine, straightness};
use crate::uncertainty::{DegreesOfFreedom, UncertaintyError, coverage_factor};

/// Draws of the profile's error: the standard deviation of the zone is known to 1/√(2·400), 4 %.
const DRAWS: u64 = 400;

/// The width of the narrowest strip that holds S, µm.
///
/// The greatest of many deviations grows with noise: the zone of a noisy profile is too wide on
/// average. [`interval`](Self::interval) allows for it, the value does not, so that it is the zone
/// of the profile as printed.
#[derive(Debug, Clone, PartialEq)]
pub struct MinimumZone {
    /// Zone of the profile, µm.
    pub value: f64,
    /// Standard deviation of the zone under the error of the profile, µm.
    pub std: f64,
    /// How much wider the error makes the zone on average, µm.
    pub widening: f64,
    /// Zones of the error alone, µm, ascending: what a straight slide would show.
    of_nothing: Vec<f64>,
}

impl MinimumZone {
    /// The interval that holds the true zone with a probability, µm: value − widening ± k·std.
    ///
    /// Where the error shapes the zone (a widening of more than a third of the standard deviation) what
    /// it adds is not known, only what it can add: a zone is a seminorm, so that the true zone is no less than
    /// the value less the zone of the error. The lower limit is that, or zero, with the error's zone at
    /// its upper quantile; the upper limit is value + k·std. The same lower limit holds where a perfectly
    /// straight slide would show as much as the value.
    ///
    /// # Errors
    /// A probability outside 0 to 1.
    pub fn interval(
        &self,
        probability: f64,
        degrees: DegreesOfFreedom,
    ) -> Result<(f64, f64), UncertaintyError> {
        let half = coverage_factor(probability, degrees)? * self.std;
        let rank = (0.5 * (1.0 + probability) * self.of_nothing.len() as f64) as usize;
        let nothing = self.of_nothing.get(rank).or(self.of_nothing.last());
        let surely = self.value - nothing.copied().unwrap_or(self.value);
        let middle = self.value - self.widening;
        if self.widening > self.std / 3.0 {
            return Ok((surely.max(0.0), self.value + half));
        }
        let low = if surely > 0.0 { middle - half } else { 0.0 };
        Ok((low.max(0.0), (middle + half).max(0.0)))
    }
}

/// The zone of a profile at positions in mm, whose errors `draw` draws; the same draws each time.
pub(super) fn minimum_zone(
    positions: &[f64],
    profile: &DVector<f64>,
    draw: impl Fn(&mut ChaCha8Rng) -> Result<DVector<f64>, FourSensorError> + Sync,
) -> Result<MinimumZone, FourSensorError> {
    let zone = |profile: &DVector<f64>| -> Result<f64, FourSensorError> {
        Ok(straightness(positions, profile.as_slice(), ReferenceLine::MinimumZone)?.error())
    };
    let value = zone(profile)?;
    let drawn: Vec<(f64, f64)> = (0..DRAWS)
        .into_par_iter()
        .map(|seed| {
            let error = draw(&mut ChaCha8Rng::seed_from_u64(seed))?;
            Ok((zone(&(profile + &error))?, zone(&error)?))
        })
        .collect::<Result<_, FourSensorError>>()?;
    let zones = DVector::from_iterator(drawn.len(), drawn.iter().map(|z| z.0));
    let mut of_nothing: Vec<f64> = drawn.iter().map(|z| z.1).collect();
    of_nothing.sort_by(f64::total_cmp);
    Ok(MinimumZone {
        value,
        std: zones.variance().sqrt(),
        widening: zones.mean() - value,
        of_nothing,
    })
}
