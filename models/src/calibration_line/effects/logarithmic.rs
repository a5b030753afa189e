//! A part of the response counts decades.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Logarithmic;

impl Effect<CalibrationLine> for Logarithmic {
    fn name(&self) -> &str {
        "logarithmic"
    }

    fn about(&self) -> About {
        About {
            physics: "a part of the response follows the logarithm of the load, as junctions and detectors do",
            confirm: "calibrate over several decades: the deviation is a straight line against the logarithm",
            source: "logarithmic response",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("per-e-fold", "y", 1e6)]
    }

    fn columns(&self, model: &CalibrationLine, _shape: &Shape) -> Vec<Column> {
        if !model.positive() {
            return Vec::new();
        }
        let reach = model.reach();
        vec![Column::from_places(model.places(), |_, place| {
            (place.x / reach).ln()
        })]
    }
}
