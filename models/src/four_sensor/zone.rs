//! The minimum-zone straightness of S, which no line of the surface changes, with its uncertainty.

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution};
use rayon::prelude::*;

use super::FourSensorError;
use crate::straightness::{ReferenceLine, straightness};
use crate::uncertainty::{DegreesOfFreedom, UncertaintyError};

/// Draws of the profile's error, each taken with both signs: the standard deviation of the zone is known
/// to 1/√(2·800), 2.5 %.
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
    drawn: Drawn,
}

/// Zones of the profile at several sizes with each drawn error added.
#[derive(Debug, Clone, PartialEq)]
struct Drawn {
    /// Sizes in shares of the profile that was found, ascending.
    sizes: Vec<f64>,
    /// One row an error: zones at the sizes, µm.
    zones: Vec<Vec<f64>>,
    /// The zone of the profile: what a unit of size adds far beyond the error, µm.
    value: f64,
}

impl MinimumZone {
    /// The interval that holds the true zone with a probability, µm.
    ///
    /// A true slide of the shape that was found, t times as large, would show the zone Z(tŜ + ε) with ε
    /// the error. The limits are t·value where the value lies at the lower and the upper end of what
    /// such slides show. Far above the error this is value ± k·std; near it, it knows that the error
    /// adds to the zone; and where a straight slide would show as much, it begins at zero and reaches
    /// to the value at least. It then holds a straight slide in one-sided (1 + probability)/2.
    ///
    /// For an error of equal size in all directions and the norm in place of the zone, what is shown
    /// depends on the size of the slide only, and the interval is exact.
    ///
    /// # Errors
    /// A probability outside 0 to 1.
    pub fn interval(
        &self,
        probability: f64,
        degrees: DegreesOfFreedom,
    ) -> Result<(f64, f64), UncertaintyError> {
        if !(probability > 0.0 && probability < 1.0) {
            return Err(UncertaintyError::BadProbability { found: probability });
        }
        let tail = 0.5 * (1.0 - probability);
        let swellings = swellings(degrees, self.drawn.zones.len());
        let low = self
            .drawn
            .size_that_shows(self.value, 1.0 - tail, &swellings);
        let high = self.drawn.size_that_shows(self.value, tail, &swellings);
        let (low, high) = (low * self.value, high * self.value);
        Ok((
            low,
            if low > 0.0 {
                high
            } else {
                high.max(self.value)
            },
        ))
    }
}

/// By how much the error may be larger than its estimate says, √(ν/χ²), one for each error; the same
/// each time.
fn swellings(degrees: DegreesOfFreedom, count: usize) -> Vec<f64> {
    let freedom = degrees.as_f64();
    let law = ChiSquared::new(freedom)
        .ok()
        .filter(|_| freedom.is_finite());
    let mut random = ChaCha8Rng::seed_from_u64(DRAWS);
    (0..count)
        .map(|_| {
            law.map_or(1.0, |law| {
                let drawn: f64 = law.sample(&mut random);
                (freedom / drawn.max(f64::MIN_POSITIVE)).sqrt()
            })
        })
        .collect()
}

impl Drawn {
    /// The size at which this share of the zones lies at or below a value; zero where less do at any.
    fn size_that_shows(&self, value: f64, share: f64, swellings: &[f64]) -> f64 {
        let wanted = share * self.zones.len() as f64;
        let enough = |size: f64| {
            let below = (0..self.zones.len()).filter(|&k| {
                // Z(tŜ + wε) = w Z(tŜ/w + ε).
                swellings[k] * self.zone(k, size / swellings[k]) <= value
            });
            below.count() as f64 >= wanted
        };
        if !enough(0.0) {
            return 0.0;
        }
        let mut outside = 2.0;
        // A zone grows without bound with its profile; heavy tails of few degrees of freedom stop here.
        while enough(outside) && outside < 1e6 {
            outside *= 2.0;
        }
        let mut inside = 0.0;
        for _ in 0..40 {
            let middle = f64::midpoint(inside, outside);
            *(if enough(middle) {
                &mut inside
            } else {
                &mut outside
            }) = middle;
        }
        inside
    }

    /// The zone of an error with the profile at a size: between the sizes drawn on a straight line, for
    /// it is a convex function of the size, and beyond them as the profile alone.
    fn zone(&self, error: usize, size: f64) -> f64 {
        let (sizes, zones) = (&self.sizes, &self.zones[error]);
        let last = sizes.len() - 1;
        if size >= sizes[last] {
            return zones[last] + self.value * (size - sizes[last]);
        }
        let next = sizes.partition_point(|s| *s <= size).clamp(1, last);
        let (a, b) = (sizes[next - 1], sizes[next]);
        let share = (size - a) / (b - a);
        zones[next - 1] + share * (zones[next] - zones[next - 1])
    }
}

/// Sizes from where the error is all to where it adds no more, close together where it bends the zone:
/// a profile of zone `value` among errors whose zones are about `error`.
fn sizes(value: f64, error: f64) -> Vec<f64> {
    /// Both in units of the error's zone.
    const NEAR: [f64; 13] = [
        0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0, 4.0, 6.0, 8.0,
    ];
    const FAR: [f64; 7] = [-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0];
    let unit = error / value;
    if unit * FAR[6] >= 1.0 {
        NEAR.map(|size| unit * size).to_vec()
    } else {
        FAR.map(|size| 1.0 + unit * size).to_vec()
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
    let error_of = |seed: u64| draw(&mut ChaCha8Rng::seed_from_u64(seed));
    // Some of them tell about how large the zone of an error is.
    let of_some = (0..20)
        .map(|seed| zone(&error_of(seed)?))
        .sum::<Result<f64, _>>()?;
    let (of_error, smallest) = (of_some / 20.0, 1e-12 * value);
    let sizes = if value > 0.0 {
        sizes(value, of_error.max(smallest))
    } else {
        vec![0.0, 1.0]
    };
    let drawn: Vec<[(f64, Vec<f64>); 2]> = (0..DRAWS)
        .into_par_iter()
        .map(|seed| {
            let error = error_of(seed)?;
            let with = |sign: f64| -> Result<(f64, Vec<f64>), FourSensorError> {
                let at = |size: f64| zone(&(profile * size + &error * sign));
                Ok((
                    at(1.0)?,
                    sizes.iter().map(|s| at(*s)).collect::<Result<_, _>>()?,
                ))
            };
            Ok([with(1.0)?, with(-1.0)?])
        })
        .collect::<Result<_, FourSensorError>>()?;
    let (as_found, zones): (Vec<f64>, _) = drawn.into_iter().flatten().unzip();
    let as_found = DVector::from_vec(as_found);
    Ok(MinimumZone {
        value,
        std: as_found.variance().sqrt(),
        widening: as_found.mean() - value,
        drawn: Drawn {
            sizes,
            zones,
            value,
        },
    })
}
