//! All sensors have the same gain error.

use super::FourSensors;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct CommonGain;

impl Effect<FourSensors> for CommonGain {
    fn name(&self) -> &str {
        "common-gain"
    }

    fn about(&self) -> About {
        About {
            physics: "all sensors are calibrated against the same wrong master",
            confirm: "read a known step with one of the sensors",
            source: "g times everything",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("gain", "1", 0.2)]
    }

    fn columns(&self, model: &FourSensors, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            model.fitted(place)
        })]
    }
}
