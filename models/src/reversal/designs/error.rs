//! Why a design has no solution.

use errsep_solvers::{FitError, NoValue};
use thiserror::Error;

use crate::basis::bspline::BreakError;
use crate::reversal::simultaneous::Reached;

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DesignFitError {
    /// A channel without a reading.
    #[error("channel {channel} has no reading")]
    NoReading {
        /// The channel.
        channel: String,
    },
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
        channel: String,
        /// The position, mm.
        x: f64,
    },
    /// Beyond 45° the readings say more about the units than about a tilt.
    #[error("the readings of channel {channel} climb at {degrees:.1} degrees; below 45 is needed")]
    TooSteep {
        /// The channel.
        channel: String,
        /// Its tilt.
        degrees: f64,
    },
    /// Fewer readings than unknowns, or too few beside them to tell the noise.
    #[error("{readings} readings are too few for {unknowns} unknowns and the noise")]
    TooFewReadings {
        /// Number of readings.
        readings: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// More cells than the readings carry.
    #[error("knots = {asked} are more than these readings carry: at most {most}")]
    TooManyKnots {
        /// How many are asked for.
        asked: usize,
        /// How many these readings carry.
        most: usize,
    },
    /// Slopes and forms so small that a thickness does not show.
    #[error(
        "these readings would give the thickness only to ± {std_mm:.3} mm: the slopes of channels and forms are too small for it to show"
    )]
    ThicknessNotDetermined {
        /// Its standard uncertainty if it were fitted, mm.
        std_mm: f64,
    },
    /// Too few positions for the shortest spline.
    #[error("no channel has more than {positions} different positions; 4 are needed")]
    TooFewPositions {
        /// Most different positions of any channel.
        positions: usize,
    },
    /// No position at which the channels that reach it tell the forms apart.
    #[error(
        "the channels have no common stretch of the slide on which the forms could be separated"
    )]
    NoOverlap,
    /// Break points that carry no spline.
    #[error("knots: {0}")]
    Breaks(#[from] BreakError),
    /// The model has no value at the start.
    #[error("the fit cannot begin: {0}")]
    NoStart(#[from] NoValue),
    /// The minimiser refuses its settings.
    #[error("the fit was not made: {0}")]
    NotMade(#[from] FitError),
    /// The fit did not end at a minimum that determines the unknowns.
    #[error("the simultaneous fit has no answer: {ending}")]
    NotConverged {
        /// How it ended, in words.
        ending: String,
        /// Where it stood then: the slopes by name, no effects.
        reached: Box<Reached>,
    },
}
