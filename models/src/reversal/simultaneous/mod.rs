//! The simultaneous solution: tilts, offsets and forms in one least-squares fit with exact geometry.
//!
//! [`fit`] takes all readings as they are (repeats, directions, different grids) and returns a
//! [`Simultaneous`]: tilts with uncertainty, forms as functions with bands, the noise of every
//! channel, residuals, knots and convergence. See `docs/theory/reversal-simultaneous.md`.

mod along;
mod closure;
mod dense;
mod error;
mod fit;
mod gauge;
mod knots;
mod levels;
mod monte_carlo;
mod noise;
mod options;
mod problem;
mod readings;
mod robust;
mod rows;
mod seed;
mod solution;
mod starts;
mod traces;
mod unknowns;

pub use dense::DenseReversal;
pub use error::ReversalError;
pub use fit::fit;
pub use gauge::Axis;
pub use knots::KnotTrial;
pub use monte_carlo::{MonteCarlo, Spread, monte_carlo};
pub use options::{Knots, Noise, Options, Thickness};
pub use problem::Reversal;
pub use readings::ChannelReadings;
pub use seed::{lines, start, tilts};
pub use solution::{
    Agreement, ChannelNoise, Closure, Convergence, FittedKnots, KnotVerdict, MOST_DENSE_READINGS,
    NoiseOrigin, Prediction, Profile, ResidualRecord, Simultaneous, Tilt,
};
pub use unknowns::{Form, Unknowns};

pub use super::staged::Value;
