//! All sensors drift alike.

use super::FourSensors;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct CommonDrift;

impl Effect<FourSensors> for CommonDrift {
    fn name(&self) -> &str {
        "common-drift"
    }

    fn about(&self) -> About {
        About {
            physics: "carriage or surface drift against each other while the slide travels, the same for all sensors",
            confirm: "stand still for as long as the travel took and record the sensors",
            source: "d(x), the same in every sensor: a part of S(x)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("drift", "um", 1e3)]
    }

    fn columns(&self, model: &FourSensors, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            model.share(place)
        })]
    }
}
