//! The zero of one sensor jumps.

use super::FourSensors;
use crate::model::Moments;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// Moments at which the search begins.
const MOST: usize = 40;

/// See the head of the file.
pub(super) struct ZeroJump;

impl Effect<FourSensors> for ZeroJump {
    fn name(&self) -> &str {
        "zero-jump"
    }

    fn about(&self) -> About {
        About {
            physics: "the zero of one sensor jumps from one reading on: a knock, a clamp that slips",
            confirm: "stand at the first position before and after the travel and read all sensors",
            source: "a constant of one sensor from a moment on",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("jump", "um", 1e4)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("time", "readings", 0.0, 1e9)]
    }

    fn grid(&self, model: &FourSensors) -> Vec<Shape> {
        let moments = Moments::of(model.places().iter());
        let all = moments.grid(0, MOST).into_iter();
        let of = |shape: Shape| {
            (0..4).map(move |variant| Shape {
                variant,
                ..shape.clone()
            })
        };
        all.flat_map(of).collect()
    }

    fn moments(&self, model: &FourSensors, _shape: &Shape) -> Vec<f64> {
        Moments::of(model.places().iter()).all()
    }

    fn columns(&self, model: &FourSensors, shape: &Shape) -> Vec<Column> {
        let Some(&moment) = shape.values.first() else {
            return Vec::new();
        };
        vec![Column::from_places(model.places(), |_, place| {
            f64::from(u8::from(
                place.channel == shape.variant && place.time > moment,
            ))
        })]
    }

    fn variant_name(&self, _model: &FourSensors, shape: &Shape) -> Option<String> {
        Some(format!("sensor {}", shape.variant + 1))
    }
}
