//! The expanded uncertainty of every figure, by propagation of distributions.
//!
//! The figures are greatest and least values of many means and standard deviations, so that a law
//! of propagation at the extreme points would leave out that another point could have been the
//! extreme one. Whole tests are simulated instead, of an axis that is as it was measured but where
//! targets that noise alone may have told apart from the extreme ones are as extreme as they; the
//! uncertainty is what 95 % of the simulated figures do not miss that axis' own by.
//! `docs/theory/positioning.md` derives it.

use rand::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::dependence::{Scatter, residuals};
use super::drift::Drift;
use super::figures::{Figure, FigureValues, Profile};
use super::readings::{Deviations, Direction, Targets};
use crate::uncertainty;

/// Coverage probability of the expanded uncertainties.
pub const COVERAGE: f64 = 0.95;

/// Simulated tests; fewer where a test has very many readings.
const TRIALS: usize = 10_000;
const FEWEST: usize = 400;
/// Means that are simulated at most, and targets.
const MOST_MEANS: usize = 4_000_000;
const MOST_TARGETS: usize = 10_000;

/// What is known of the measurement beside its readings: expanded uncertainties (k = 2), µm or
/// seconds of arc.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Influences {
    /// Of the device over the measured length, in proportion to the distance from the first target.
    pub device: f64,
    /// Of the misalignment of device and axis, likewise.
    pub misalignment: f64,
    /// Of temperature and coefficients of expansion, likewise.
    pub expansion: f64,
    /// Of the difference of two means from a drift that all runs have alike, which does not scatter
    /// them.
    pub drift: f64,
}

impl Influences {
    /// Standard uncertainty of the deviation at the last target against that at the first.
    fn of_length(&self) -> f64 {
        0.5 * [self.device, self.misalignment, self.expansion]
            .iter()
            .fold(0.0_f64, |sum, u| sum.hypot(*u))
    }

    /// Standard uncertainty of one mean from drift.
    fn of_mean(&self) -> f64 {
        0.5 * self.drift / std::f64::consts::SQRT_2
    }
}

/// The uncertainty of a figure, from the magnitudes of the errors of simulated tests; unit of the figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FigureUncertainty {
    /// Root mean square of the errors.
    pub standard: f64,
    /// The share [`COVERAGE`] of them is not greater.
    pub expanded: f64,
}

/// Why a figure has no uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoUncertainty {
    /// One run.
    #[error("one run does not show how readings scatter")]
    OneRun,
    /// Runs that are equal to the last digit.
    #[error("all runs are equal: the readings are rounded more coarsely than they scatter")]
    NoScatter,
    /// Standard deviations that differ.
    #[error(
        "readings scatter differently from target to target, and so few runs do not tell how much at each"
    )]
    ScatterDiffers,
    /// More targets than tests are simulated of.
    #[error("there are more than 10 000 targets")]
    TooManyTargets,
    /// A drift with time.
    #[error("the readings drift with time, so that they do not scatter independently")]
    Drifts,
    /// Runs at heights of their own.
    #[error(
        "whole runs lie at heights of their own, as zeroing anew or a drift leaves them, so that their readings do \
         not scatter independently"
    )]
    RunsDiffer,
    /// The same with times that do not exclude a drift, which shifts one direction against the other.
    #[error(
        "whole runs lie at heights of their own that may be a drift, which shifts one direction against the other"
    )]
    MayDrift,
    /// Readings of a run that are alike.
    #[error(
        "neighbouring readings of a run are alike, so that the targets do not tell the scatter independently"
    )]
    ReadingsAlike,
}

/// The uncertainty of each figure that the profile tells.
pub(super) fn expanded(
    deviations: &Deviations,
    profile: &Profile,
    (scatter, drift): (Option<&Scatter>, Option<&Drift>),
    influences: &Influences,
    seed: u64,
) -> Vec<(Figure, Result<FigureUncertainty, NoUncertainty>)> {
    let told: Vec<Figure> = FigureValues::of(profile).iter().map(|(f, _)| f).collect();
    let none = |why| told.iter().map(|f| (*f, Err(why))).collect();
    let Some(scatter) = scatter else {
        return none(NoUncertainty::OneRun);
    };
    if scatter.std == 0.0 {
        return none(NoUncertainty::NoScatter);
    }
    if deviations.targets.len() > MOST_TARGETS {
        return none(NoUncertainty::TooManyTargets);
    }
    let shifts = |drift: &Drift| drift.shows() || drift.may;
    let why = [
        (drift.is_some_and(Drift::shows), NoUncertainty::Drifts),
        (
            scatter.runs_differ() || drift.is_some_and(|d| d.may),
            NoUncertainty::RunsDiffer,
        ),
        (scatter.depends(), NoUncertainty::ReadingsAlike),
        (scatter.differs(), NoUncertainty::ScatterDiffers),
    ];
    let why = why.into_iter().find(|(is, _)| *is).map(|(_, why)| why);
    let noise = match why {
        None => Noise::Independent {
            std: scatter.std,
            runs: deviations.runs,
        },
        Some(_) => Noise::ByRun {
            residuals: residuals(deviations),
            runs: deviations.runs,
        },
    };
    let found = Test::new(deviations, profile, noise, *influences).expanded(seed);
    told.into_iter()
        .map(|figure| match why {
            Some(why) if figure.rests_on_scatter() => (figure, Err(why)),
            // A drift shifts one direction against the other, and their mean difference most clearly.
            Some(why)
                if matches!(figure, Figure::BMean | Figure::UMean) && drift.is_some_and(shifts) =>
            {
                let shows = why == NoUncertainty::Drifts;
                let why = if shows { why } else { NoUncertainty::MayDrift };
                (figure, Err(why))
            }
            _ => {
                let own = found.iter().find(|(f, _)| *f == figure);
                (figure, own.map(|(_, u)| *u).ok_or(NoUncertainty::NoScatter))
            }
        })
        .collect()
}

/// How the means of a simulated test scatter.
enum Noise {
    /// Every reading by itself, alike everywhere.
    Independent { std: f64, runs: usize },
    /// Whole runs, as those that were measured: whatever they have in common stays so. By
    /// direction, target and run.
    ByRun {
        residuals: Vec<Targets>,
        runs: usize,
    },
}

/// Targets less than this many standard deviations from the extreme one, as that is measured, are taken
/// to be as extreme: for figures of means, and for those that rest on scatter, whose greatest values
/// lie farther out. Both by the coverage that they give (`docs/validation/coverage.md`).
const TIED: f64 = 3.0;
const TIED_SCATTER: f64 = 2.0;

/// The axis of which a figure is simulated.
struct World {
    figure: Figure,
    /// Means by direction and target.
    mean: [Vec<f64>; 2],
    /// The figure of these.
    truth: f64,
}

/// How an axis is measured.
struct Test {
    worlds: Vec<World>,
    noise: Noise,
    influences: Influences,
    /// Places of the targets, 0 at the first and 1 at the last.
    along: Vec<f64>,
    /// Which directions are there.
    there: [bool; 2],
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
    fn new(
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
            there: [0, 1].map(|d| profile.mean[d].is_some()),
        }
    }

    /// The errors of each figure, as their root mean square and as what the share [`COVERAGE`] does not exceed.
    fn expanded(&self, seed: u64) -> Vec<(Figure, FigureUncertainty)> {
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
                    Noise::Independent { std, runs } => {
                        std / self.independent(*std, *runs, random, errors)
                    }
                    Noise::ByRun { residuals, runs } => {
                        self.by_run(residuals, *runs, random, errors);
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

    /// Means and standard deviations of independent readings; returns the pooled standard deviation
    /// that such a test would find.
    fn independent(
        &self,
        std: f64,
        runs: usize,
        random: &mut impl Rng,
        errors: &mut Errors,
    ) -> f64 {
        let of_mean = std / (runs as f64).sqrt();
        let freedom = (runs - 1) as f64;
        let law = ChiSquared::new(freedom);
        let (mut sum, mut count) = (0.0, 0.0);
        for d in (0..2).filter(|d| self.there[*d]) {
            for (mean, own) in errors.sampled[d].iter_mut().zip(&mut errors.std[d]) {
                let normal: f64 = StandardNormal.sample(random);
                *mean = of_mean * normal;
                let share = law.map_or(1.0, |law| law.sample(random) / freedom);
                *own = std * share.sqrt();
                sum += share;
                count += 1.0;
            }
        }
        // No test with two runs or more has a pooled variance of zero.
        std * (sum / f64::max(count, 1.0)).sqrt().max(f64::MIN_POSITIVE)
    }

    /// Means as runs like those measured would give them: their covariance is that of the residuals,
    /// known from as many runs less one.
    fn by_run(
        &self,
        residuals: &[Targets],
        runs: usize,
        random: &mut impl Rng,
        errors: &mut Errors,
    ) {
        let freedom = (runs - 1) as f64;
        let share = ChiSquared::new(freedom).map_or(1.0, |law| law.sample(random) / freedom);
        let scale = 1.0 / (share.max(f64::MIN_POSITIVE) * freedom * runs as f64).sqrt();
        let weights: Vec<f64> = (0..runs)
            .map(|_| StandardNormal.sample(&mut *random))
            .collect();
        let there = (0..2).filter(|d| self.there[*d]);
        for (d, rows) in there.zip(residuals) {
            for (mean, row) in errors.sampled[d].iter_mut().zip(rows) {
                let error: f64 = row.iter().zip(&weights).map(|(r, w)| r * w).sum();
                *mean = scale * error;
            }
        }
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

/// The means of an axis on which targets that noise may have told apart are alike: those that are extreme
/// for a figure, a few of its standard deviations at a target from the extreme one. `more`
/// is the variance of each mean beside its scatter.
fn tied(figure: Figure, profile: &Profile, noise: &Noise, more: f64) -> [Vec<f64>; 2] {
    let [forward, backward] = [0, 1].map(|d| profile.mean[d].clone().unwrap_or_default());
    let both = forward.iter().zip(&backward);
    let middle: Vec<f64> = both.clone().map(|(f, b)| 0.5 * (f + b)).collect();
    let reversal: Vec<f64> = both.map(|(f, b)| f - b).collect();
    let joined = |middle: Vec<f64>, reversal: Vec<f64>| {
        let side = |sign: f64| {
            let both = middle.iter().zip(&reversal);
            both.map(|(m, b)| m + sign * 0.5 * b).collect::<Vec<_>>()
        };
        [side(1.0), side(-1.0)]
    };
    let of_mean = noise.variance(|f, _| f, 1.0) + more;
    // Variance of the standard deviation of one target and direction.
    let of_std = noise.variance_of_std();
    let of_reversal = noise.variance(|f, b| f - b, 2.0) + 2.0 * more;
    let tied = if figure.rests_on_scatter() {
        TIED_SCATTER
    } else {
        TIED
    };
    let width = |variance: f64| tied * variance.sqrt();
    match figure {
        Figure::EForward
        | Figure::AForward
        | Figure::EBackward
        | Figure::ABackward
        | Figure::E
        | Figure::A
        | Figure::P => {
            let variance = of_mean
                + match figure {
                    Figure::A | Figure::AForward | Figure::ABackward => 4.0 * of_std,
                    Figure::P => 4.5 * of_std,
                    _ => 0.0,
                };
            let used: Vec<f64> = figure
                .directions()
                .iter()
                .flat_map(|d| [&forward, &backward][d.index()].iter().copied())
                .collect();
            let (low, high) = drawn_in(&used, width(variance));
            [forward, backward].map(|side| side.iter().map(|m| m.clamp(low, high)).collect())
        }
        Figure::M | Figure::Pa => {
            let variance = noise.variance(|f, b| 0.5 * (f + b), 0.5) + 0.5 * more;
            let (low, high) = drawn_in(&middle, width(variance));
            joined(
                middle.iter().map(|m| m.clamp(low, high)).collect(),
                reversal,
            )
        }
        Figure::B | Figure::U | Figure::UMean | Figure::R => {
            let variance = match figure {
                Figure::R => of_reversal + 8.0 * of_std,
                _ => of_reversal,
            };
            let greatest = reversal.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            let most = (greatest - width(variance)).max(0.0);
            joined(
                middle,
                reversal.iter().map(|b| b.clamp(-most, most)).collect(),
            )
        }
        Figure::BMean | Figure::RForward | Figure::RBackward | Figure::Ps | Figure::PsMean => {
            [forward, backward]
        }
    }
}

/// The range of values less `width` at either end; its middle where nothing is left.
fn drawn_in(values: &[f64], width: f64) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if high - low > 2.0 * width {
        (low + width, high - width)
    } else {
        let middle = low + 0.5 * (high - low);
        (middle, middle)
    }
}

impl Noise {
    /// The standard deviation of a reading, where it is one.
    const fn std(&self) -> Option<f64> {
        match self {
            Self::Independent { std, .. } => Some(*std),
            Self::ByRun { .. } => None,
        }
    }

    /// Variance of the standard deviation of one target and direction, σ²/(2(n − 1)).
    fn variance_of_std(&self) -> f64 {
        match self {
            Self::Independent { std, runs } => std * std / (2 * (runs - 1)) as f64,
            Self::ByRun { .. } => 0.0,
        }
    }

    /// Variance of a mean over the runs of a combination of both directions (of the one direction
    /// there is), `factor` times that of one mean where readings are independent.
    fn variance(&self, combine: impl Fn(f64, f64) -> f64, factor: f64) -> f64 {
        match self {
            Self::Independent { std, runs } => factor * std * std / *runs as f64,
            Self::ByRun { residuals, runs } => {
                let Some(first) = residuals.first() else {
                    return 0.0;
                };
                let second = residuals.get(1).unwrap_or(first);
                let targets = first.len();
                let mut sum = 0.0;
                for run in 0..*runs {
                    let of = |rows: &[Vec<f64>], i: usize| {
                        rows.get(i).and_then(|r| r.get(run)).copied().unwrap_or(0.0)
                    };
                    let values: Vec<f64> = (0..targets)
                        .map(|i| combine(of(first, i), of(second, i)))
                        .collect();
                    // What a run shifts at all targets alike is no spread over the targets.
                    let mean = values.iter().sum::<f64>() / targets as f64;
                    sum += values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
                }
                let freedom = (targets - 1) * (runs - 1) * runs;
                sum / freedom.max(1) as f64
            }
        }
    }
}
