//! Why there is no simultaneous solution.

use errsep_solvers::{FitError, NoValue};
use thiserror::Error;

use super::knots::FEWEST_POSITIONS;
use super::reached::Reached;
use crate::basis::bspline::BreakError;

/// Fewest readings beyond the unknowns from which the noise is told.
pub const FEWEST_FREE: usize = 3;

/// Why there is no simultaneous solution.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ReversalError {
    /// No reading at all.
    #[error("there are no readings")]
    NoReadings,
    /// A reading or option that is not finite, or not in its range.
    #[error("{what} is {value}: it must be {must}")]
    NotUsable {
        /// What it is.
        what: String,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// A channel whose readings are all at one position has no slope.
    #[error("channel {channel}: all readings are at {x} mm; a slope needs two positions")]
    OnePosition {
        /// The channel.
        channel: &'static str,
        /// The position, mm.
        x: f64,
    },
    /// Beyond 45° the readings say more about the units than about a tilt.
    #[error("the readings of channel {channel} climb at {degrees:.1} degrees; below 45 is needed")]
    TooSteep {
        /// The channel.
        channel: &'static str,
        /// Its tilt.
        degrees: f64,
    },
    /// With tilts and forms this small the thickness leaves no trace in the readings.
    #[error(
        "these readings would give the thickness only to ± {std_mm:.3} mm: the tilts and slopes are too small for it to show"
    )]
    ThicknessNotDetermined {
        /// Its standard uncertainty if it were fitted, mm.
        std_mm: f64,
    },
    /// Fewer readings than unknowns.
    #[error(
        "{readings} readings cannot determine {unknowns} unknowns: take more readings or fewer knots"
    )]
    TooFewReadings {
        /// Number of readings.
        readings: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// Too few readings beside the unknowns to tell the noise.
    #[error(
        "{readings} readings beside {unknowns} unknowns leave {freedom} degrees of freedom: without a stated noise at least {FEWEST_FREE} are needed to tell the noise and with it the uncertainty"
    )]
    TooFewToTellNoise {
        /// Number of readings.
        readings: usize,
        /// Number of unknowns.
        unknowns: usize,
        /// Their difference.
        freedom: usize,
    },
    /// Too few positions for the forms of the shortest spline.
    #[error(
        "the readings of no channel have more than {positions} different positions; {FEWEST_POSITIONS} are needed"
    )]
    TooFewPositions {
        /// Most different positions of any channel.
        positions: usize,
    },
    /// More cells than the readings carry.
    #[error("knots = {asked} are more than these readings carry: at most {most}")]
    TooManyKnots {
        /// How many are asked for.
        asked: usize,
        /// How many these readings carry.
        most: usize,
    },
    /// A tilt that these readings leave open.
    #[error(
        "these readings do not determine {name} with {cells} knots: its standard uncertainty would be {times:.0} times that of a line through the readings"
    )]
    NotDetermined {
        /// Its name.
        name: String,
        /// Number of cells.
        cells: usize,
        /// How many times.
        times: f64,
    },
    /// An effect that nobody knows.
    #[error("no effect is called `{effect}`")]
    UnknownEffect {
        /// The name.
        effect: String,
    },
    /// An effect asked for twice.
    #[error("the effect {effect} is asked for twice")]
    EffectTwice {
        /// Its name.
        effect: &'static str,
    },
    /// A start of an effect that has no such variant or another number of unknowns.
    #[error("the effect {effect} has no variant and unknowns like those of the start given")]
    EffectStart {
        /// Its name.
        effect: &'static str,
    },
    /// An effect that the fit takes up, or has in it already.
    #[error("{effect} cannot join this fit: {why}")]
    EffectRefused {
        /// Its name.
        effect: &'static str,
        /// Why.
        why: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A size that the readings leave open.
    #[error(
        "these readings do not determine the {parameter} of {effect}: its standard uncertainty would be {std:.3} {unit}, more than its whole plausible range"
    )]
    EffectNotDetermined {
        /// The effect.
        effect: &'static str,
        /// Its parameter.
        parameter: String,
        /// Its standard uncertainty.
        std: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A size that no machine has.
    #[error(
        "with {effect} in the fit its {parameter} would be {value:.4} {unit}; plausible is {low} to {high} {unit}: it is not what these readings show"
    )]
    EffectImplausible {
        /// The effect.
        effect: &'static str,
        /// Its parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Smallest plausible value.
        low: f64,
        /// Greatest plausible value.
        high: f64,
    },
    /// The fit with effects does not end at a minimum that determines everything.
    #[error("the fit with {effects} has no answer: {ending}")]
    EffectsNotConverged {
        /// The effects.
        effects: String,
        /// How it ended, in words.
        ending: String,
        /// Where it stood then.
        reached: Box<Reached>,
    },
    /// Break points that carry no spline.
    #[error("knots: {0}")]
    Breaks(#[from] BreakError),
    /// The start given has the wrong length.
    #[error("{given} starting tilts are given, the fit has {needed}")]
    StartLength {
        /// How many are given.
        given: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The model has no value at the start.
    #[error("the fit cannot begin: {0}")]
    NoStart(#[from] NoValue),
    /// The minimiser refuses its settings, or an observer broke it off.
    #[error("the fit was not made: {0}")]
    NotMade(FitError),
    /// The fit did not end at a minimum that determines the unknowns.
    #[error("the simultaneous fit has no answer: {ending}")]
    NotConverged {
        /// How it ended, in words.
        ending: String,
        /// Where it stood then.
        reached: Box<Reached>,
    },
}

impl ReversalError {
    /// Whether a fit was made that did not end at a minimum which determines everything.
    pub(super) fn is_no_minimum(&self) -> bool {
        matches!(
            self,
            Self::NotConverged { .. }
                | Self::EffectsNotConverged { .. }
                | Self::NotDetermined { .. }
        )
    }
}

impl From<FitError> for ReversalError {
    fn from(error: FitError) -> Self {
        match error {
            FitError::NoValueAtStart { reason } => Self::NoStart(NoValue::new(reason)),
            other => Self::NotMade(other),
        }
    }
}
