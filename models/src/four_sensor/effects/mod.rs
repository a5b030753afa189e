//! What the four-sensor model leaves out: one file an effect.

mod common_drift;
mod common_gain;
mod drift;
mod gain;
mod sensor_position;
mod slide_position;

use super::diagnosable::FourSensors;
use crate::model::Effect;

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<FourSensors>>> {
    vec![
        Box::new(common_drift::CommonDrift),
        Box::new(common_gain::CommonGain),
        Box::new(drift::Drift),
        Box::new(gain::Gain),
        Box::new(sensor_position::SensorPosition),
        Box::new(slide_position::SlidePosition),
    ]
}
