//! One sensor does not stand where the analysis puts it.

use super::FourSensors;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::units::UM_PER_MM;

/// See the head of the file.
pub(super) struct SensorPosition;

impl Effect<FourSensors> for SensorPosition {
    fn name(&self) -> &str {
        "sensor-position"
    }

    fn about(&self) -> About {
        About {
            physics: "one sensor stands a little further along the carriage than the set-up says, so that it reads another place of the surface and has another arm",
            confirm: "measure the distance of the sensors by driving each over the same edge",
            source: "f(x + p + d) - f(x + p) + d tilt; Zhao et al. (2019), position error PE1",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("position", "mm", 1.0)]
    }

    fn grid(&self, _model: &FourSensors) -> Vec<Shape> {
        (1..4).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &FourSensors, shape: &Shape) -> Option<String> {
        Some(format!("sensor {}", shape.variant + 1))
    }

    fn columns(&self, model: &FourSensors, shape: &Shape) -> Vec<Column> {
        let way = shape.values.first().copied().unwrap_or(0.0);
        vec![Column::from_places(model.places(), |_, place| {
            if place.channel == shape.variant {
                model.curves().surface_chord(model, place, way) + UM_PER_MM * model.tilt(place)
            } else {
                0.0
            }
        })]
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        shape.settled_at(amplitudes)
    }
}
