//! The expanded uncertainty of every figure, by propagation of distributions.
//!
//! The figures are greatest and least values of many means and standard deviations, so that a law
//! of propagation at the extreme points would leave out that another point could have been the
//! extreme one. Whole tests are simulated instead, of an axis that is as it was measured but where
//! targets that noise alone may have told apart from the extreme ones are as extreme as they; the
//! uncertainty is what 95 % of the simulated figures do not miss that axis' own by.
//! `docs/theory/positioning.md` derives it.

mod noise;
mod simulated;
mod tied;

use super::dependence::Dependence;
use super::figures::{Figure, FigureValues, Profile};
use super::readings::Deviations;
use noise::Noise;
use simulated::Test;

/// Coverage probability of the expanded uncertainties.
pub const COVERAGE: f64 = 0.95;

/// Targets at most.
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

/// Means and what they are made of.
pub(super) struct Means<'a> {
    pub(super) profile: &'a Profile,
    /// Heights of the runs that the means are freed of; empty where they are not.
    pub(super) heights: &'a [f64],
}

/// The uncertainty of each figure that the profile tells.
pub(super) fn expanded(
    deviations: &Deviations,
    means: &Means,
    dependence: &Dependence,
    influences: &Influences,
    seed: u64,
) -> Vec<(Figure, Result<FigureUncertainty, NoUncertainty>)> {
    let told: Vec<Figure> = FigureValues::of(means.profile)
        .iter()
        .map(|(f, _)| f)
        .collect();
    let none = |why| told.iter().map(|f| (*f, Err(why))).collect();
    let Some(std) = dependence.std else {
        return none(NoUncertainty::OneRun);
    };
    if std == 0.0 {
        return none(NoUncertainty::NoScatter);
    }
    if deviations.targets.len() > MOST_TARGETS {
        return none(NoUncertainty::TooManyTargets);
    }
    let noise = match dependence.why {
        None => Noise::independent(std, deviations),
        Some(_) => Noise::by_run(deviations, means),
    };
    let found = Test::new(deviations, means.profile, noise, *influences).expanded(seed);
    told.into_iter()
        .map(|figure| match (dependence.why, dependence.shifted) {
            (Some(why), _) if figure.rests_on_scatter() => (figure, Err(why)),
            // A drift shifts one direction against the other, and their mean difference most clearly.
            (_, Some(why)) if matches!(figure, Figure::BMean | Figure::UMean) => (figure, Err(why)),
            _ => {
                let own = found.iter().find(|(f, _)| *f == figure);
                (figure, own.map(|(_, u)| *u).ok_or(NoUncertainty::NoScatter))
            }
        })
        .collect()
}
