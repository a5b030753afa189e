//! What the four-sensor model leaves out: one file an effect.

mod common_drift;
mod common_gain;
mod drift;
mod gain;
mod lag;
mod nonlinearity;
mod sensor_position;
mod settling;
mod slide_position;
mod zero_jump;

use super::diagnosable::FourSensors;
use crate::model::{Effect, Parameter};

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<FourSensors>>> {
    vec![
        Box::new(common_drift::CommonDrift),
        Box::new(common_gain::CommonGain),
        Box::new(drift::Drift),
        Box::new(gain::Gain),
        Box::new(lag::Lag),
        Box::new(nonlinearity::Nonlinearity),
        Box::new(sensor_position::SensorPosition),
        Box::new(settling::Settling),
        Box::new(slide_position::SlidePosition),
        Box::new(zero_jump::ZeroJump),
    ]
}

/// What the size of an effect on readings of four sensors is: its first amplitude. `None` where the catalogue has no such
/// effect.
pub fn amplitude(effect: &str) -> Option<Parameter> {
    crate::model::amplitude(&all(), effect)
}
