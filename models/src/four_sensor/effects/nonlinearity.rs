//! The characteristic of one sensor is bent.

use super::FourSensors;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Nonlinearity;

impl Effect<FourSensors> for Nonlinearity {
    fn name(&self) -> &str {
        "nonlinearity"
    }

    fn about(&self) -> About {
        About {
            physics: "the reading of one sensor bends over its range: a capacitive or inductive sensor far from its middle",
            confirm: "calibrate the sensor over its range, or repeat nearer to its middle",
            source: "the square of the reading about the sensor's zero, as great as told at its greatest reading",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-reach", "um", 1e3)]
    }

    fn grid(&self, _model: &FourSensors) -> Vec<Shape> {
        (0..4).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &FourSensors, shape: &Shape) -> Option<String> {
        Some(format!("sensor {}", shape.variant + 1))
    }

    fn columns(&self, model: &FourSensors, shape: &Shape) -> Vec<Column> {
        let mine = model.places().iter().filter(|p| p.channel == shape.variant);
        let reach = mine
            .map(|p| model.fitted(p).abs())
            .fold(f64::MIN_POSITIVE, f64::max);
        vec![Column::from_places(model.places(), |_, place| {
            if place.channel == shape.variant {
                (model.fitted(place) / reach).powi(2)
            } else {
                0.0
            }
        })]
    }
}
