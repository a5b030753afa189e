//! The radius changes while the points are taken.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct RadiusGrowth;

impl Effect<CirclePoints> for RadiusGrowth {
    fn name(&self) -> &str {
        "radius-growth"
    }

    fn about(&self) -> About {
        About {
            physics: "the part, or the axis that carries the probe, grows while the points are taken, so that the circle becomes a spiral",
            confirm: "measure the first points again at the end, and again after an hour at rest",
            source: "an even change of the radius with time; ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("over-the-test", "um", 1e4)]
    }

    fn columns(&self, model: &CirclePoints, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            model.moment(place)
        })]
    }
}
