//! The scale of the instrument is wrong in all directions.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::units::UM_PER_MM;

/// See the head of the file.
pub(super) struct Scale;

impl Effect<CirclePoints> for Scale {
    fn name(&self) -> &str {
        "scale"
    }

    fn about(&self) -> About {
        About {
            physics: "the scale of the instrument is wrong in all directions alike: temperature, calibration",
            confirm: "measure a master of known radius",
            source: "radius times scale; nothing else changes",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("scale", "1", 1e-2)]
    }

    fn columns(&self, model: &CirclePoints, _shape: &Shape) -> Vec<Column> {
        let radius_um = model.circle().radius * UM_PER_MM;
        vec![Column::from_places(model.places(), |_, _| radius_um)]
    }
}
