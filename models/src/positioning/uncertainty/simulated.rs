//! Simulated tests of a known axis, and what their figures miss that axis' own by.

use rand::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::super::figures::{Figure, FigureValues, Profile};
use super::super::readings::{Deviations, Direction};
use super::noise::{Noise, Readings};
use super::tied::tied;
use super::{COVERAGE, FigureUncertainty, Influences};
use crate::uncertainty;

/// Simulated tests; fewer where a test has very many readings.
const TRIALS: usize = 10_000;
const FEWEST: usize = 400;
/// Means that are simulated at most, and targets.
const MOST_MEANS: usize = 4_000_000;

/// The axis of which a figure is simulated.
struct World {
    figure: Figure,
    /// Means by direction and target.
    mean: [Vec<f64>; 2],
    /// The figure of these.
    truth: f64,
}

/// How an axis is measured.
pub(super) struct Test {
    worlds: Vec<World>,
    noise: Noise,
    influences: Influences,
    /// Places of the targets, 0 at the first and 1 at the last.
    along: Vec<f64>,
}

/// What one simulated test finds beside the truth, by direction and target.
#[derive(Clone, Default)]
struct Errors {
    /// Of the means, from scatter.
    sampled: [Vec<f64>; 2],
    /// Of the means, from scatter and what is stated.
    all: [Vec<f64>; 2],
    /// Standard deviations.
    std: [Vec<f64>; 2],
}

impl Test {
    pub(super) fn new(
        deviations: &Deviations,
        profile: &Profile,
        noise: Noise,
        influences: Influences,
    ) -> Self {
        let length = deviations.length();
        let first = deviations.targets.first().copied().unwrap_or_default();
        let targets = deviations.targets.iter();
        let std = noise.std();
        let worlds = FigureValues::of(profile)
            .iter()
            .filter(|(figure, _)| std.is_some() || !figure.rests_on_scatter())
            .map(|(figure, _)| {
                let mean = tied(figure, profile, &noise, influences.of_mean().powi(2));
                let of =
                    |d: Direction, i: usize| mean[d.index()].get(i).copied().unwrap_or_default();
                let truth = figure.value(deviations.targets.len(), of, |_, _| std.unwrap_or(0.0));
                World {
                    figure,
                    mean,
                    truth,
                }
            })
            .collect();
        Self {
            worlds,
            noise,
            influences,
            along: targets.map(|t| (t - first) / length).collect(),
        }
    }

    /// The errors of each figure, as their root mean square and as what the share [`COVERAGE`] does not exceed.
    pub(super) fn expanded(&self, seed: u64) -> Vec<(Figure, FigureUncertainty)> {
        let count = (MOST_MEANS / (2 * self.along.len())).clamp(FEWEST, TRIALS);
        let targets = self.along.len();
        let room = || {
            let pair = || [vec![0.0; targets], vec![0.0; targets]];
            Errors {
                sampled: pair(),
                all: pair(),
                std: pair(),
            }
        };
        let trials = uncertainty::simulate(
            count,
            self.worlds.len(),
            seed,
            room,
            |random, errors, row| {
                let scale = match &self.noise {
                    Noise::Independent { std, readings } => {
                        std / independent(*std, readings, random, errors)
                    }
                    Noise::ByRun { residuals, runs } => {
                        by_run(residuals, *runs, random, errors);
                        1.0
                    }
                };
                self.influence(random, errors);
                for (world, error) in self.worlds.iter().zip(row) {
                    *error = world.error(errors, scale);
                }
            },
        );
        let Ok(trials) = trials else {
            return Vec::new();
        };
        let place = (COVERAGE * count as f64).ceil() as usize - 1;
        let found = self.worlds.iter().enumerate().filter_map(|(k, world)| {
            let errors = trials.output(k)?;
            let sum: f64 = errors.sorted().iter().map(|e| e * e).sum();
            let uncertainty = FigureUncertainty {
                standard: (sum / count as f64).sqrt(),
                expanded: *errors.sorted().get(place)?,
            };
            Some((world.figure, uncertainty))
        });
        found.collect()
    }

    /// Adds what device, misalignment, expansion and drift do.
    fn influence(&self, random: &mut impl Rng, errors: &mut Errors) {
        let normal: f64 = StandardNormal.sample(random);
        let slope = normal * self.influences.of_length();
        let of_mean = self.influences.of_mean();
        for (all, sampled) in errors.all.iter_mut().zip(&errors.sampled) {
            for ((all, sampled), along) in all.iter_mut().zip(sampled).zip(&self.along) {
                *all = sampled + slope * along;
                if of_mean > 0.0 {
                    let normal: f64 = StandardNormal.sample(random);
                    *all += of_mean * normal;
                }
            }
        }
    }
}

/// Means and standard deviations of independent readings; returns the pooled standard deviation
/// that such a test would find.
fn independent(
    std: f64,
    readings: &[Vec<Readings>; 2],
    random: &mut impl Rng,
    errors: &mut Errors,
) -> f64 {
    let (mut sum, mut freedoms) = (0.0, 0.0);
    for (d, readings) in readings.iter().enumerate() {
        let errors = errors.sampled[d].iter_mut().zip(&mut errors.std[d]);
        for ((mean, own), readings) in errors.zip(readings) {
            let normal: f64 = StandardNormal.sample(random);
            *mean = std / readings.count.sqrt() * normal;
            let freedom = readings.freedom();
            let law = readings.law.as_ref();
            let squares = law.map_or(freedom, |law| law.sample(random));
            *own = std * (squares / freedom).sqrt();
            sum += squares;
            freedoms += freedom;
        }
    }
    // No test with two runs or more has a pooled variance of zero.
    std * (sum / f64::max(freedoms, 1.0))
        .sqrt()
        .max(f64::MIN_POSITIVE)
}

/// Means as runs like those measured would give them: their covariance is that of the residuals,
/// known from as many runs less one.
fn by_run(residuals: &[Vec<Vec<f64>>; 2], runs: usize, random: &mut impl Rng, errors: &mut Errors) {
    let freedom = (runs - 1) as f64;
    let share = ChiSquared::new(freedom).map_or(1.0, |law| law.sample(random) / freedom);
    let scale = 1.0 / (share.max(f64::MIN_POSITIVE) * freedom * runs as f64).sqrt();
    let weights: Vec<f64> = (0..runs)
        .map(|_| StandardNormal.sample(&mut *random))
        .collect();
    for (means, rows) in errors.sampled.iter_mut().zip(residuals) {
        for (mean, row) in means.iter_mut().zip(rows) {
            let error: f64 = row.iter().zip(&weights).map(|(r, w)| r * w).sum();
            *mean = scale * error;
        }
    }
}

impl World {
    /// The magnitude of the error of its figure: that of scatter, in proportion to the standard
    /// deviation that such a test would find, and that of what is stated.
    fn error(&self, errors: &Errors, scale: f64) -> f64 {
        let targets = errors.std[0].len();
        let std = |d: Direction, i: usize| errors.std[d.index()][i];
        let with = |means: &[Vec<f64>; 2]| {
            let mean = |d: Direction, i: usize| self.mean[d.index()][i] + means[d.index()][i];
            self.figure.value(targets, mean, std)
        };
        let sampled = with(&errors.sampled);
        (scale * (sampled - self.truth) + (with(&errors.all) - sampled)).abs()
    }
}
