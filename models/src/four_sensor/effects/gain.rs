//! The gain of one sensor is wrong.

use super::FourSensors;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Gain;

impl Effect<FourSensors> for Gain {
    fn name(&self) -> &str {
        "gain"
    }

    fn about(&self) -> About {
        About {
            physics: "one sensor reads too much or too little by a factor",
            confirm: "read a known step with each sensor",
            source: "g times the reading of one sensor; Zhao et al. (2019), section 3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("gain", "1", 0.2)]
    }

    fn grid(&self, _model: &FourSensors) -> Vec<Shape> {
        (0..4).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &FourSensors, shape: &Shape) -> Option<String> {
        Some(format!("sensor {}", shape.variant + 1))
    }

    fn columns(&self, model: &FourSensors, shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            f64::from(u8::from(place.channel == shape.variant)) * model.fitted(place)
        })]
    }
}
