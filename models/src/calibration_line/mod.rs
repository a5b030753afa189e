//! A straight calibration line y = a + b x through readings in one or several sets, and what bends it.
//!
//! x and y carry the units of the user's columns, which are called `x` and `y` here.

mod effects;
mod fitted;
mod lack_of_fit;
pub mod simulate;

pub use effects::amplitude;
pub use fitted::{CalibrationLine, CalibrationReading, NotALine};
pub use lack_of_fit::{LackOfFit, lack_of_fit};
