//! The response rises as a square root at small loads.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct SquareRoot;

impl Effect<CalibrationLine> for SquareRoot {
    fn name(&self) -> &str {
        "square-root"
    }

    fn about(&self) -> About {
        About {
            physics: "a part of the response follows the square root of the load, as flow follows pressure",
            confirm: "calibrate at loads far below the first one: the slope grows without end towards zero",
            source: "square-root law of throttles and contacts",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-full-scale", "y", 1e6)]
    }

    fn columns(&self, model: &CalibrationLine, _shape: &Shape) -> Vec<Column> {
        if !model.positive() {
            return Vec::new();
        }
        let reach = model.reach();
        vec![Column::from_places(model.places(), |_, place| {
            (place.x / reach).sqrt()
        })]
    }
}
