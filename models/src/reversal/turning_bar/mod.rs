//! A bar that turns in the spindle while the slide feeds past one indicator.
//!
//! With θ the angle of the spindle, φ the direction of the indicator and ψ = φ − θ the side of the bar
//! that it sees
//!
//! ```text
//!     reading = a₀(x) + (e + γx)·n(ψ) + Σ_{k≥2} [a_k(x) cos kψ + b_k(x) sin kψ] + (α + τ)·x + constant
//! ```
//!
//! θ is recorded, or found: steady, or with a spline in time for what strays from it. [`Run`] holds the
//! readings, [`Survey`] what they tell before any fit, [`Analysis`] every fit and what it says. See
//! `docs/theory/reversal-turning.md`.

mod analysis;
mod answers;
mod contrasts;
mod cut_off;
#[cfg(test)]
mod equal_to_dense;
mod error;
mod fit;
mod left;
mod meat;
mod nearest;
mod noise;
mod once_a_turn;
mod pairs;
mod possible;
mod problem;
mod run;
mod setting;
pub mod simulate;
mod spread;
mod start;
mod strays;

pub use analysis::{Analysis, Plan, Rival, analyse};
pub use answers::{Bar, Harmonic, Told, TurnCurve};
pub use contrasts::{Scatter, TurnResidual, TurnResiduals, turn_residuals};
pub use error::TurningError;
pub use fit::{TurningFit, bent, steady, unsteady};
pub use noise::{laws, misfit};
pub use once_a_turn::{OnceATurn, once_a_turn};
pub use pairs::Pairs;
pub use possible::Possible;
pub use problem::Frame;
pub use run::{FEWEST_PER_TURN, FEWEST_READINGS, FEWEST_TURNS, Run, TurningReading};
pub use setting::{Along, HIGHEST_HARMONIC, Setting, Wave};
pub use spread::{Slow, Spread};
pub use start::{BarStart, Survey, TurnWave};
