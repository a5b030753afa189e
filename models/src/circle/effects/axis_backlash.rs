//! An axis loses motion where it reverses.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// The variant of the x axis; the other is that of y.
const X: usize = 0;

/// See the head of the file.
pub(super) struct AxisBacklash;

impl Effect<CirclePoints> for AxisBacklash {
    fn name(&self) -> &str {
        "axis-backlash"
    }

    fn about(&self) -> About {
        About {
            physics: "an axis stands still for a while where it reverses, so that the circle has a step at both ends of that axis",
            confirm: "take the circle in the other direction: the step changes its sign",
            source: "half of the lost motion against the direction of the axis, along it; reversal error, ISO 230-4",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("lost-motion", "um", 1e3)]
    }

    fn grid(&self, _model: &CirclePoints) -> Vec<Shape> {
        (0..2).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &CirclePoints, shape: &Shape) -> Option<String> {
        Some(
            if shape.variant == X {
                "x axis"
            } else {
                "y axis"
            }
            .to_owned(),
        )
    }

    fn columns(&self, model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            let (sin, cos) = CirclePoints::angle(place).sin_cos();
            let (along, speed) = match shape.variant {
                X => (cos, -sin),
                _ => (sin, cos),
            };
            -0.5 * along * (place.direction * speed).signum()
        })]
    }
}
