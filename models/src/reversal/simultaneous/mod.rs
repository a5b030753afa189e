//! The simultaneous solution: tilts, offsets and forms in one least-squares fit with exact geometry.
//!
//! [`fit`] takes all readings as they are (repeats, directions, different grids) and returns a
//! [`Simultaneous`]: tilts with uncertainty, forms as functions with bands, the noise of every
//! channel, residuals, knots and convergence. Effects that the model leaves out can be unknowns of
//! the same fit ([`effects`]). See `docs/theory/reversal-simultaneous.md`.

mod closure;
mod columns;
mod counting;
mod covariances;
mod dense;
mod descent;
pub mod effects;
mod error;
mod fit;
pub(super) mod fitted_knots;
pub(super) mod gauge;
mod ground;
mod joined;
pub(super) mod knots;
mod levelled;
mod monte_carlo;
mod options;
mod placed;
mod placed_rows;
mod pointer;
mod predict;
mod problem;
mod profiles;
mod reached;
mod readings;
mod robust;
mod row_source;
pub(super) mod rows;
mod rungs;
mod search;
mod seed;
mod solution;
pub(super) mod starts;
mod told;
mod unknowns;
mod weighed;

pub use covariances::Covariances;
#[doc(hidden)]
pub use dense::DenseReversal;
pub use error::ReversalError;
pub use fit::fit;
pub use fitted_knots::{FittedKnots, KnotVerdict};
pub use gauge::Axis;
pub use knots::KnotTrial;
pub use monte_carlo::{MonteCarlo, Spread, monte_carlo};
pub use options::{Knots, Noise, Options, Thickness, With};
pub use predict::{MOST_DENSE_READINGS, Prediction};
pub use problem::Reversal;
pub use reached::Reached;
pub use readings::ChannelReadings;
pub use seed::{lines, start, tilts};
pub use solution::{
    Agreement, ChannelNoise, Closure, Convergence, NoiseOrigin, Profile, ResidualRecord,
    SharedNoise, Simultaneous, Tilt,
};
pub use told::{EffectParameter, FittedEffect};
pub use unknowns::{Form, Unknowns};

pub use super::staged::Value;
