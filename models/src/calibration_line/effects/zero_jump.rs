//! The zero jumps.

use super::CalibrationLine;
use crate::model::Moments;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// Moments at which the search begins.
const MOST: usize = 40;

/// See the head of the file.
pub(super) struct ZeroJump;

impl Effect<CalibrationLine> for ZeroJump {
    fn name(&self) -> &str {
        "zero-jump"
    }

    fn about(&self) -> About {
        About {
            physics: "the zero jumps from one reading on: a knock, a clamp that slips, an overload",
            confirm: "read the zero before and after every set",
            source: "a constant from a moment on",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("jump", "y", 1e6)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("time", "time", 0.0, 1e9)]
    }

    fn grid(&self, model: &CalibrationLine) -> Vec<Shape> {
        Moments::of(model.places().iter()).grid(0, MOST)
    }

    fn moments(&self, model: &CalibrationLine, _shape: &Shape) -> Vec<f64> {
        Moments::of(model.places().iter()).all()
    }

    fn columns(&self, model: &CalibrationLine, shape: &Shape) -> Vec<Column> {
        let Some(&moment) = shape.values.first() else {
            return Vec::new();
        };
        vec![Column::from_places(model.places(), |_, place| {
            f64::from(u8::from(place.time > moment))
        })]
    }
}
