//! Why a run of a turning bar has no solution.

use errsep_solvers::{FitError, NoValue};
use thiserror::Error;

use crate::basis::bspline::BreakError;

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TurningError {
    /// Too few readings.
    #[error(
        "{readings} readings are too few: a run of three turns with 20 readings a turn is needed"
    )]
    TooFew {
        /// How many there are.
        readings: usize,
    },
    /// Too few turns.
    #[error("the run has {turns:?} turns: three or more are needed")]
    TooFewTurns {
        /// How many there are.
        turns: f64,
    },
    /// A turn has too few readings.
    #[error("a turn has {readings:?} readings: twelve or more are needed")]
    TooFewPerTurn {
        /// How many there are.
        readings: f64,
    },
    /// Two readings at one time, or a time that goes back.
    #[error("reading {index}: times must grow")]
    Time {
        /// Which reading, from 0.
        index: usize,
    },
    /// The spindle jumps back.
    #[error("reading {index}: the spindle angle jumps back by {degrees:.1} degrees")]
    JumpsBack {
        /// Which reading, from 0.
        index: usize,
        /// How far.
        degrees: f64,
    },
    /// The slide goes back.
    #[error("reading {index}: the slide goes back by {by_mm} mm")]
    SlideBack {
        /// Which reading, from 0.
        index: usize,
        /// How far, mm.
        by_mm: f64,
    },
    /// The slide stands.
    #[error("the slide does not move: all readings are at {x_mm} mm")]
    NoTravel {
        /// Where it stands, mm.
        x_mm: f64,
    },
    /// Neither times nor angles.
    #[error("there is neither a time nor a spindle angle")]
    NoClock,
    /// A number that is not finite.
    #[error("reading {index}: the {what} is not finite")]
    NotFinite {
        /// Which reading, from 0.
        index: usize,
        /// What of it.
        what: &'static str,
    },
    /// A setting that cannot be.
    #[error("{what} is {value}: it must be {must}")]
    NotUsable {
        /// What it is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// Nothing turns.
    #[error("no once-per-turn wave stands out of the readings")]
    NoWave,
    /// More unknowns than the readings carry.
    #[error("{readings} readings are too few for {unknowns} unknowns")]
    TooManyUnknowns {
        /// Number of readings.
        readings: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// Break points that carry no spline.
    #[error("{0}")]
    Breaks(#[from] BreakError),
    /// The model has no value at the start.
    #[error("the fit cannot begin: {0}")]
    NoStart(#[from] NoValue),
    /// The minimiser refuses its settings.
    #[error("the fit was not made: {0}")]
    NotMade(#[from] FitError),
    /// The fit did not end at a minimum that determines the unknowns.
    #[error("the fit has no answer: {ending}")]
    NotConverged {
        /// How it ended, in words.
        ending: String,
        /// Root mean square of the residuals where it stood, µm.
        residual_rms_um: f64,
        /// Steps made.
        iterations: u64,
    },
}
