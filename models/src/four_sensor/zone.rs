//! The minimum-zone straightness of S, which no line of the surface changes, with its uncertainty.

use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;

use super::FourSensorError;
use crate::straightness::{ReferenceLine, straightness};
use crate::uncertainty::DegreesOfFreedom;
use crate::zone::{Judged, straightness_error};

pub use crate::zone::StraightnessError as MinimumZone;

/// Draws of the profile's error: with both signs the standard deviation of the zone is known to
/// 1/√(2·800), 2.5 %.
const DRAWS: u64 = 400;

/// The zone of a profile at positions in mm, whose errors `draw` draws with a standard deviation of the
/// noise that is known to `degrees` of freedom.
pub(super) fn minimum_zone(
    positions: &[f64],
    profile: &DVector<f64>,
    degrees: DegreesOfFreedom,
    draw: impl Fn(&mut ChaCha8Rng) -> Result<DVector<f64>, FourSensorError> + Sync,
) -> Result<MinimumZone, FourSensorError> {
    let strip = |profile: &DVector<f64>| {
        straightness(positions, profile.as_slice(), ReferenceLine::MinimumZone)
    };
    let found = strip(profile)?;
    let judged = Judged {
        deviations: DVector::from_fn(profile.len(), |n, _| {
            found.deviation(positions[n], profile[n])
        }),
        profile,
        degrees,
        draws: DRAWS,
    };
    straightness_error(&judged, |profile| Ok(strip(profile)?.error()), draw)
}
