//! The air of the dead path changes.

use super::DiagonalRuns;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct DeadPath;

impl Effect<DiagonalRuns> for DeadPath {
    fn name(&self) -> &str {
        "dead-path"
    }

    fn about(&self) -> About {
        About {
            physics: "the air between interferometer and zero point changes while the compensation knows nothing of that path",
            confirm: "stand at the zero point for as long as a run takes and record the laser",
            source: "dead path times change of the refractive index, even in time; ISO 230-6",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("over-the-test", "um", 1e3)]
    }

    fn columns(&self, model: &DiagonalRuns, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            model.moment(place)
        })]
    }
}
