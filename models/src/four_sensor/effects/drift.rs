//! One sensor drifts over the travel.

use super::FourSensors;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Drift;

impl Effect<FourSensors> for Drift {
    fn name(&self) -> &str {
        "drift"
    }

    fn about(&self) -> About {
        About {
            physics: "one sensor or its holder drifts evenly while the slide travels",
            confirm: "stand still for as long as the travel took and record that sensor",
            source: "linear drift of one sensor; Zhao et al. (2019), section 3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("drift", "um", 1e3)]
    }

    fn grid(&self, _model: &FourSensors) -> Vec<Shape> {
        (0..4).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &FourSensors, shape: &Shape) -> Option<String> {
        Some(format!("sensor {}", shape.variant + 1))
    }

    fn columns(&self, model: &FourSensors, shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            f64::from(u8::from(place.channel == shape.variant)) * model.share(place)
        })]
    }
}
