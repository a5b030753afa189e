//! The response bends evenly over the range.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Quadratic;

impl Effect<CalibrationLine> for Quadratic {
    fn name(&self) -> &str {
        "quadratic"
    }

    fn about(&self) -> About {
        About {
            physics: "the response bends evenly over the range, as a spring or a strain bridge does to second order",
            confirm: "calibrate with more loads beyond the range: the deviation grows with the square of the load",
            source: "second-order term of the response; NIST StRD Pontius",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-full-scale", "y", 1e6)]
    }

    fn columns(&self, model: &CalibrationLine, _shape: &Shape) -> Vec<Column> {
        let reach = model.reach();
        vec![Column::from_places(model.places(), |_, place| {
            (place.x / reach).powi(2)
        })]
    }
}
