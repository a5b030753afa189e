//! What a straight calibration line leaves out: one file an effect.

mod cubic;
mod drift;
mod hysteresis;
mod logarithmic;
mod quadratic;
mod saturation;
mod sensitivity_drift;
mod set_offset;
mod set_slope;
mod square_root;
mod zero_jump;

use super::CalibrationLine;
use crate::model::{Effect, Parameter};

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<CalibrationLine>>> {
    vec![
        Box::new(cubic::Cubic),
        Box::new(drift::Drift),
        Box::new(hysteresis::Hysteresis),
        Box::new(logarithmic::Logarithmic),
        Box::new(quadratic::Quadratic),
        Box::new(saturation::Saturation),
        Box::new(sensitivity_drift::SensitivityDrift),
        Box::new(set_offset::SetOffset),
        Box::new(set_slope::SetSlope),
        Box::new(square_root::SquareRoot),
        Box::new(zero_jump::ZeroJump),
    ]
}

/// What the size of an effect on calibration readings is: its first amplitude. `None` where the catalogue has no such
/// effect.
pub fn amplitude(effect: &str) -> Option<Parameter> {
    crate::model::amplitude(&all(), effect)
}
