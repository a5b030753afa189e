//! The straightness error of a profile whose errors are known, with its uncertainty.

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution};
use rayon::prelude::*;

use crate::uncertainty::{DegreesOfFreedom, UncertaintyError};

/// The width of the strip along its reference line that holds a profile, µm.
///
/// The greatest of many deviations grows with noise: the zone of a noisy profile is too wide on
/// average. [`interval`](Self::interval) allows for it, the value does not, so that it is the zone
/// of the profile as printed.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightnessError {
    /// Zone of the profile, µm.
    pub value: f64,
    /// Standard deviation of the zone under the error of the profile, µm.
    pub std: f64,
    /// How much wider the error makes the zone on average, µm.
    pub widening: f64,
    drawn: Drawn,
}

/// Zones of slides of several sizes with each drawn error added.
#[derive(Debug, Clone, PartialEq)]
struct Drawn {
    /// Zones of the slides in shares of the value, ascending.
    sizes: Vec<f64>,
    /// One row an error: zones of the slides with it, µm.
    zones: Vec<Vec<f64>>,
    /// The value, µm: what a unit of size adds far beyond the error.
    value: f64,
}

impl StraightnessError {
    /// The interval that holds the true zone with a probability, µm.
    ///
    /// For each width there is a slide that is nearest to the one found: its deviations from the middle
    /// of the strip cut at the width, or in proportion for a greater one. With the error added it would
    /// show other widths. The limits are those for which the value lies at the upper and at the lower
    /// end of what would be shown. Far above the error this is value ± k·std; near it, and where many
    /// places touch the strip, it knows that the error adds to the zone; and where a straight slide would
    /// show as much, it begins at zero and reaches to the value at least. It then holds a straight slide
    /// with (1 + probability)/2, one-sided.
    ///
    /// # Errors
    /// A probability outside 0 to 1.
    pub fn interval(&self, probability: f64) -> Result<(f64, f64), UncertaintyError> {
        if !(probability > 0.0 && probability < 1.0) {
            return Err(UncertaintyError::BadProbability { found: probability });
        }
        let tail = 0.5 * (1.0 - probability);
        let limit = |share: f64| self.value * self.drawn.size_that_shows(self.value, share);
        let (low, high) = (limit(1.0 - tail), limit(tail));
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

impl Drawn {
    /// The size at which this share of the zones lies at or below a value; zero where less do at any.
    fn size_that_shows(&self, value: f64, share: f64) -> f64 {
        let wanted = share * self.zones.len() as f64;
        let enough = |size: f64| {
            let below = (0..self.zones.len()).filter(|&k| self.zone(k, size) <= value);
            below.count() as f64 >= wanted
        };
        if !enough(0.0) {
            return 0.0;
        }
        let (mut inside, mut outside) = (0.0, 2.0);
        // A zone grows without bound with its slide; heavy tails of few degrees of freedom stop here.
        while enough(outside) && outside < 1e6 {
            outside *= 2.0;
        }
        for _ in 0..40 {
            let middle = f64::midpoint(inside, outside);
            if enough(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    }

    /// The zone of a slide of a size with an error: between the sizes drawn on a straight line, beyond
    /// them as the slide alone.
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
/// a slide of zone `value` among errors whose zones are about `error`.
fn sizes(value: f64, error: f64) -> Vec<f64> {
    /// Both in units of the error's zone.
    const NEAR: [f64; 13] = [
        0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0, 4.0, 6.0, 8.0,
    ];
    const FAR: [f64; 11] = [-4.0, -2.0, -1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0, 2.0, 4.0];
    let unit = error / value;
    if unit * FAR[10] >= 1.0 {
        let mut sizes = NEAR.map(|size| unit * size).to_vec();
        // The slide found itself, where cutting ends.
        let place = sizes.partition_point(|size| *size < 1.0);
        if sizes.get(place).is_some_and(|size| *size > 1.0) {
            sizes.insert(place, 1.0);
        }
        sizes
    } else {
        FAR.map(|size| 1.0 + unit * size).to_vec()
    }
}

/// A profile that was found, and how its width is judged.
pub struct Judged<'a> {
    /// µm.
    pub profile: &'a DVector<f64>,
    /// Its deviations from the middle of its strip, µm.
    pub deviations: DVector<f64>,
    /// How well the noise behind its errors is known.
    pub degrees: DegreesOfFreedom,
    /// Errors to draw, each taken with both signs: n of them tell the standard deviation of the zone to
    /// 1/√(4n).
    pub draws: u64,
}

/// The width `zone` of a profile whose errors `draw` draws; the same draws each time.
///
/// # Errors
/// Those of `zone` and `draw`.
pub fn straightness_error<E: Send>(
    judged: &Judged,
    zone: impl Fn(&DVector<f64>) -> Result<f64, E> + Sync,
    draw: impl Fn(&mut ChaCha8Rng) -> Result<DVector<f64>, E> + Sync,
) -> Result<StraightnessError, E> {
    let profile = judged.profile;
    let value = zone(profile)?;
    // Some of them tell about how large the zone of an error is.
    let some = (0..20)
        .map(|seed| zone(&draw(&mut ChaCha8Rng::seed_from_u64(seed))?))
        .sum::<Result<f64, _>>()?;
    let sizes = if value > 0.0 {
        sizes(value, (some / 20.0).max(1e-12 * value))
    } else {
        vec![0.0, 1.0]
    };
    let slides: Vec<DVector<f64>> = sizes
        .iter()
        .map(|s| of_width(&judged.deviations, *s, value))
        .collect();
    let drawn: Vec<[(f64, Vec<f64>); 2]> = (0..judged.draws)
        .into_par_iter()
        .map(|seed| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let error = draw(&mut random)?;
            let swelling = swelling(judged.degrees, &mut random);
            let with = |sign: f64| -> Result<(f64, Vec<f64>), E> {
                let swollen = &error * (sign * swelling);
                let zones = slides.iter().map(|slide| zone(&(slide + &swollen)));
                Ok((
                    zone(&(profile + &error * sign))?,
                    zones.collect::<Result<_, _>>()?,
                ))
            };
            Ok([with(1.0)?, with(-1.0)?])
        })
        .collect::<Result<_, E>>()?;
    let (as_found, zones): (Vec<f64>, _) = drawn.into_iter().flatten().unzip();
    let as_found = DVector::from_vec(as_found);
    Ok(StraightnessError {
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

/// The slide of a size nearest to the one found, whose deviations from the middle of its strip of width
/// `value` these are.
fn of_width(deviations: &DVector<f64>, size: f64, value: f64) -> DVector<f64> {
    if size < 1.0 {
        let half = 0.5 * size.max(0.0) * value;
        deviations.map(|d| d.clamp(-half, half))
    } else {
        deviations * size
    }
}

/// By how much the error may be larger than the noise that was estimated says, √(ν/χ²).
fn swelling(degrees: DegreesOfFreedom, random: &mut ChaCha8Rng) -> f64 {
    let freedom = degrees.as_f64();
    match ChiSquared::new(freedom) {
        Ok(law) if freedom.is_finite() => {
            let drawn: f64 = law.sample(random);
            (freedom / drawn.max(f64::MIN_POSITIVE)).sqrt()
        }
        _ => 1.0,
    }
}
