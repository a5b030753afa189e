//! One sensor shows late what it sees.

use super::FourSensors;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Lag;

impl Effect<FourSensors> for Lag {
    fn name(&self) -> &str {
        "lag"
    }

    fn about(&self) -> About {
        About {
            physics: "one sensor has a slower filter than the others, so that it shows what it saw a little way before",
            confirm: "feed at half the speed: the way becomes half as long",
            source: "minus the way times the slope of its reading along the travel; first-order low-pass",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("way", "mm", 0.0, 10.0)]
    }

    fn grid(&self, _model: &FourSensors) -> Vec<Shape> {
        (0..4).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &FourSensors, shape: &Shape) -> Option<String> {
        Some(format!("sensor {}", shape.variant + 1))
    }

    fn columns(&self, model: &FourSensors, shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            if place.channel == shape.variant {
                -model.curves().reading_slope(model, place)
            } else {
                0.0
            }
        })]
    }
}
