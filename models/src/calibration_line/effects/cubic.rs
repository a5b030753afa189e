//! The response bends oppositely at its two ends.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Cubic;

impl Effect<CalibrationLine> for Cubic {
    fn name(&self) -> &str {
        "cubic"
    }

    fn about(&self) -> About {
        About {
            physics: "the response bends oppositely on both sides of its middle, as a symmetrical transducer does to third order",
            confirm: "calibrate with loads of both signs: the deviation turns its sign with the load",
            source: "third-order term of the response",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-full-scale", "y", 1e6)]
    }

    fn columns(&self, model: &CalibrationLine, _shape: &Shape) -> Vec<Column> {
        let reach = model.reach();
        vec![Column::from_places(model.places(), |_, place| {
            (place.x / reach).powi(3)
        })]
    }
}
