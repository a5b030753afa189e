//! The axes that measure the points are not square.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::units::UM_PER_MM;

/// See the head of the file.
pub(super) struct Squareness;

impl Effect<CirclePoints> for Squareness {
    fn name(&self) -> &str {
        "squareness"
    }

    fn about(&self) -> About {
        About {
            physics: "the axes that measure or make the circle are not square to each other, so that it becomes an ellipse along the diagonals",
            confirm: "turn the part by 90 degrees and measure again: the ellipse stays along the diagonals of the axes",
            source: "radius times angle times sin cos; ISO 230-4",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("angle", "rad", 1e-2)]
    }

    fn columns(&self, model: &CirclePoints, _shape: &Shape) -> Vec<Column> {
        let radius_um = model.circle().radius * UM_PER_MM;
        vec![Column::from_places(model.places(), |_, place| {
            let (sin, cos) = CirclePoints::angle(place).sin_cos();
            radius_um * sin * cos
        })]
    }
}
