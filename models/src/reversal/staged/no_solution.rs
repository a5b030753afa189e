//! Why a reversal has no staged solution.

use thiserror::Error;

/// Why there is no staged solution.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NoSolution {
    /// No channel at all.
    #[error("there are no readings")]
    NoReadings,
    /// A reading, position, or option is not finite or not positive where it must be.
    #[error("{what} is {value}")]
    NotUsable {
        /// What.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A line and a form need three positions.
    #[error(
        "channel {channel} has readings at {positions} different positions; its line and its form need at least 3"
    )]
    TooFewPositions {
        /// Which channel.
        channel: &'static str,
        /// Its different positions.
        positions: usize,
    },
    /// Beyond 45° the readings say more about the units than about a tilt.
    #[error("the readings of channel {channel} climb at {degrees:.1} degrees; below 45 is needed")]
    TooSteep {
        /// Which channel.
        channel: &'static str,
        /// Its tilt.
        degrees: f64,
    },
    /// The traces have too little in common.
    #[error("the traces have {positions} positions in common; at least 3 are needed")]
    NoOverlap {
        /// Positions left.
        positions: usize,
    },
    /// Rotation would put points of a trace in another order.
    #[error("channel {channel} cannot be rotated: its readings jump more than its step allows")]
    Folded {
        /// Which channel.
        channel: &'static str,
    },
}
