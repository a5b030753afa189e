//! What errs by more than white noise lets it: repeats once each is separated by itself, outputs whose noise is correlated along
//! the slide.
//!
//! The scatter of their readings tells the noise as if it were white and alike in all sensors. A drift of a
//! sensor within a repeat is neither, nor is a sensor noisier than the others; the separation adds such errors
//! up along the slide far beyond what white noise of their size gives. The repeats separated one by one, with
//! the λ of their average, show it, whatever the cause: there the repeat is what is independent.

use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{Along, FourSensorError, Parabola, Separation};
use crate::noise::Law;
use crate::uncertainty::DegreesOfFreedom;

/// Below this probability the repeats scatter by more than the noise of their readings gives.
const LEVEL: f64 = 0.01;

/// Draws of the errors that white noise gives.
pub(super) const DRAWS: u64 = 200;

/// f, S, γ and e of one separation, or errors of them.
pub type Found = [DVector<f64>; 4];

/// By how much errors are greater than white noise of the readings gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excess {
    /// Standard deviations over those of white noise: of f, S and γ, 1 at least.
    pub factors: [f64; 3],
    /// Degrees of freedom of the least known of them.
    pub degrees: DegreesOfFreedom,
    /// What tells it.
    pub told_by: ToldBy,
}

/// What tells that errors are greater than white noise gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToldBy {
    /// Repeats, each separated by itself.
    Repeats {
        /// Probability that white noise shows as much.
        p_value: f64,
    },
    /// The outputs against each other.
    Outputs {
        /// The law of the noise of one reading, µm².
        law: Law,
    },
}

impl Separation {
    /// f, S, γ and e.
    pub fn found(&self) -> Found {
        [
            self.surface.values.clone(),
            self.straightness.values.clone(),
            self.tilt.values.clone(),
            DVector::from_column_slice(&self.zero_adjustment),
        ]
    }

    /// Compares repeats, each separated by itself, with `draws` of the errors that white noise gives to their
    /// average, the noise known to `degrees`; where they scatter by more, the uncertainties count it.
    pub fn count_repeats(
        &mut self,
        each: &[Found],
        draws: &[Found],
        degrees: DegreesOfFreedom,
        parabola: Parabola,
    ) {
        // Sensors may be zeroed anew before each repeat, which shifts S and γ as a whole.
        let free = !matches!(parabola, Parabola::ZeroAdjustment(_));
        let compared: Option<Vec<Compared>> = (0..3)
            .map(|which| Compared::of(each, draws, which, free && which > 0, degrees))
            .collect();
        let Some(compared) = compared else { return };
        // The greatest of three that are looked at.
        let least = compared.iter().map(|c| c.p_value).fold(1.0, f64::min);
        let least = (3.0 * least).min(1.0);
        if least >= LEVEL {
            return;
        }
        let beyond = |c: &&Compared| c.ratio > 1.0;
        let known = compared.iter().filter(beyond).map(|c| c.freedom);
        let Ok(degrees) = DegreesOfFreedom::new(known.fold(f64::INFINITY, f64::min).max(1.0))
        else {
            return;
        };
        let factor = |at: usize| compared.get(at).map_or(1.0, |c| c.ratio.max(1.0).sqrt());
        let factors = [factor(0), factor(1), factor(2)];
        self.beyond_noise(|which, _| factors[which].powi(2));
        for std in &mut self.zero_adjustment_std {
            *std *= factors[0];
        }
        self.excess = Some(Excess {
            factors,
            degrees,
            told_by: ToldBy::Repeats { p_value: least },
        });
    }

    /// Counts noise that is correlated along the slide: by the mean squares of the errors that it gives to f, S, γ and e, `correlated`,
    /// against those of white noise, `white`.
    pub(super) fn count_correlation(&mut self, along: &Along, correlated: &Found, white: &Found) {
        let Ok(degrees) = DegreesOfFreedom::new(along.freedom()) else {
            return;
        };
        // The line that is taken away leaves no noise where it is held.
        let ratio = |correlated: f64, white: f64| {
            if white > 0.0 {
                (correlated / white).max(1.0)
            } else {
                1.0
            }
        };
        self.beyond_noise(|which, n| ratio(correlated[which][n], white[which][n]));
        let factors =
            [0, 1, 2].map(|which| ratio(correlated[which].sum(), white[which].sum()).sqrt());
        let zero = correlated[3].iter().zip(white[3].iter());
        for (std, (correlated, white)) in self.zero_adjustment_std.iter_mut().zip(zero) {
            *std *= ratio(*correlated, *white).sqrt();
        }
        self.excess = Some(Excess {
            factors,
            degrees,
            told_by: ToldBy::Outputs { law: along.law() },
        });
    }

    /// Multiplies the variances that the noise of readings gives to f, S, γ at each place.
    fn beyond_noise(&mut self, by: impl Fn(usize, usize) -> f64) {
        let held_back = self.scatter.held_back;
        let seminorm = self.chosen.point.seminorm;
        let profiles = [&mut self.surface, &mut self.straightness, &mut self.tilt];
        for (which, profile) in profiles.into_iter().enumerate() {
            let both = profile.std.iter_mut().zip(profile.bias_bound.iter());
            for (n, (std, bound)) in both.enumerate() {
                let pull = if seminorm > 0.0 {
                    held_back * bound / seminorm
                } else {
                    0.0
                };
                let noise = (*std * *std - pull * pull).max(0.0);
                *std = (by(which, n) * noise + pull * pull).sqrt();
            }
        }
    }
}

/// One of f, S, γ: variance of the mean of the repeats over that of white noise.
struct Compared {
    ratio: f64,
    freedom: f64,
    p_value: f64,
}

impl Compared {
    fn of(
        each: &[Found],
        draws: &[Found],
        which: usize,
        less_mean: bool,
        degrees: DegreesOfFreedom,
    ) -> Option<Self> {
        let repeats = each.len() as f64;
        let square = |v: &DVector<f64>| {
            let height = if less_mean { v.mean() } else { 0.0 };
            v.iter().map(|v| (v - height).powi(2)).sum::<f64>()
        };
        let (first, rest) = each.split_first()?;
        let sum = rest
            .iter()
            .fold(first[which].clone(), |sum, one| sum + &one[which]);
        let mean = sum / repeats;
        let apart: f64 = each.iter().map(|one| square(&(&one[which] - &mean))).sum();
        let observed = apart / (repeats * (repeats - 1.0));
        let drawn: Vec<f64> = draws.iter().map(|one| square(&one[which])).collect();
        let count = drawn.len() as f64;
        let expected = drawn.iter().sum::<f64>() / count;
        let spread = drawn.iter().map(|q| (q - expected).powi(2)).sum::<f64>() / (count - 1.0);
        // Satterthwaite: a few long waves are most of the error.
        let freedom = (repeats - 1.0) * 2.0 * expected * expected / spread;
        let ratio = observed / expected;
        if !(ratio.is_finite() && freedom > 0.0) {
            return None;
        }
        let known = degrees.as_f64().min(1e6);
        let law = FisherSnedecor::new(freedom, known).ok()?;
        Some(Self {
            ratio,
            freedom,
            p_value: law.sf(ratio),
        })
    }
}

/// Mean squares of [`DRAWS`] errors of f, S, γ and e.
pub(super) fn mean_squares(
    draw: impl Fn(u64) -> Result<Found, FourSensorError>,
) -> Result<Found, FourSensorError> {
    let mut mean = draw(0)?.map(|error| error * 0.0);
    for one in 0..DRAWS {
        for (mean, error) in mean.iter_mut().zip(draw(one)?) {
            *mean += error.map(|error| error * error / DRAWS as f64);
        }
    }
    Ok(mean)
}

/// The generator of a draw.
pub(super) fn random(draw: u64) -> ChaCha8Rng {
    use rand::SeedableRng;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    random.set_stream(draw);
    random
}
