//! What a straight calibration line leaves out: one file an effect.

mod cubic;
mod drift;
mod logarithmic;
mod quadratic;
mod saturation;
mod set_offset;
mod square_root;

use super::CalibrationLine;
use crate::model::Effect;

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<CalibrationLine>>> {
    vec![
        Box::new(cubic::Cubic),
        Box::new(drift::Drift),
        Box::new(logarithmic::Logarithmic),
        Box::new(quadratic::Quadratic),
        Box::new(saturation::Saturation),
        Box::new(set_offset::SetOffset),
        Box::new(square_root::SquareRoot),
    ]
}
