//! The machine grows, or the air changes, while the runs are taken.

use super::DiagonalRuns;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::units::UM_PER_MM;

/// See the head of the file.
pub(super) struct ThermalExpansion;

impl Effect<DiagonalRuns> for ThermalExpansion {
    fn name(&self) -> &str {
        "thermal-expansion"
    }

    fn about(&self) -> About {
        About {
            physics: "the scales of the machine grow while the runs are taken, or the index of the air changes and the laser is not corrected for it",
            confirm: "record the temperatures of scales and air, and repeat the first run at the end",
            source: "distance along the diagonal times a share that grows with time; ISO 230-3, ISO 230-6",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("over-the-test", "1", 1e-3)]
    }

    fn columns(&self, model: &DiagonalRuns, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            UM_PER_MM * place.x * model.moment(place)
        })]
    }
}
