//! The zero of the probe jumps.

use super::CirclePoints;
use crate::model::Moments;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// Moments at which the search begins.
const MOST: usize = 40;

/// See the head of the file.
pub(super) struct ZeroJump;

impl Effect<CirclePoints> for ZeroJump {
    fn name(&self) -> &str {
        "zero-jump"
    }

    fn about(&self) -> About {
        About {
            physics: "the zero of the probe jumps from one point on: a collision, a tip that slips in its holder",
            confirm: "probe a reference sphere before and after every pass",
            source: "a constant along the radius from a moment on",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("jump", "um", 1e5)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("time", "readings", 0.0, 1e9)]
    }

    fn grid(&self, model: &CirclePoints) -> Vec<Shape> {
        Moments::of(model.places().iter()).grid(0, MOST)
    }

    fn moments(&self, model: &CirclePoints, _shape: &Shape) -> Vec<f64> {
        Moments::of(model.places().iter()).all()
    }

    fn columns(&self, model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        let Some(&moment) = shape.values.first() else {
            return Vec::new();
        };
        vec![Column::from_places(model.places(), |_, place| {
            f64::from(u8::from(place.time > moment))
        })]
    }
}
