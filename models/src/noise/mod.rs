//! The noise of readings that are taken along traces, and what repeats tell of it.
//!
//! One reading = white noise + a part that is correlated along its trace (Ornstein–Uhlenbeck: a Markov
//! process of variance o and correlation exp(−|Δx|/ℓ)) + a shift of the whole trace + a line by
//! which the whole trace drifts about its middle. [`Law`] holds the variances, [`Contrasts`] what differs between repeats of a trace, and [`Posterior`] which laws
//! these, or other [values](NoiseValues) that hold nothing but noise, allow. Nothing here needs a matrix of
//! readings × readings: every product with a covariance is one pass along the trace, at any spacing.

mod contrasts;
mod law;
mod likelihood;
mod moments;
mod posterior;
mod without_lines;

pub use contrasts::Contrasts;
pub use law::{Law, about_middle, decays, drift_form, markov_form};
pub use likelihood::{Likelihood, Likelihoods, OfWhole};
pub use moments::Moments;
pub use posterior::{NoiseValues, Possible, Posterior};
pub use without_lines::WithoutLines;

/// A trace of this many readings can show what is correlated along it.
const LONG: usize = 20;
