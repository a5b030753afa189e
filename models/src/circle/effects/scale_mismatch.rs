//! The scales of the two axes differ.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::units::UM_PER_MM;

/// See the head of the file.
pub(super) struct ScaleMismatch;

impl Effect<CirclePoints> for ScaleMismatch {
    fn name(&self) -> &str {
        "scale-mismatch"
    }

    fn about(&self) -> About {
        About {
            physics: "the scale of x is not that of y: two screws, two compensations, a servo mismatch",
            confirm: "turn the part by 45 degrees and measure again: the oval stays along the axes",
            source: "radius times scale along x: r s cos^2; ISO 230-4",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("scale-of-x", "1", 1e-2)]
    }

    fn columns(&self, model: &CirclePoints, _shape: &Shape) -> Vec<Column> {
        let radius_um = model.circle().radius * UM_PER_MM;
        vec![Column::from_places(model.places(), |_, place| {
            radius_um * CirclePoints::angle(place).cos().powi(2)
        })]
    }
}
