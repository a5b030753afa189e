//! A tilt that grows along an axis acts at a height.

use super::MeasuredParts;
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Parameter, Shape};
use crate::units::um_from_mm;

/// Axes of the plane of the parts.
const AXES: [Axis; 2] = [Axis::X, Axis::Y];

/// See the head of the file.
pub(super) struct AngularErrorTimesHeight;

impl Effect<MeasuredParts> for AngularErrorTimesHeight {
    fn name(&self) -> &str {
        "angular-error-times-height"
    }

    fn about(&self) -> About {
        About {
            physics: "a slide tilts more and more along its travel, and the tilt acts with the height of the point above the plane in which the machine was measured",
            confirm: "make and measure parts at two heights: the deviation grows with the height",
            source: "angle times lever: z EBX(x), z EAY(y); Abbe",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("tilt-per-length", "rad/mm", 1e-5)]
    }

    fn grid(&self, _model: &MeasuredParts) -> Vec<Shape> {
        (0..AXES.len()).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &MeasuredParts, shape: &Shape) -> Option<String> {
        Some(format!("axis {}", AXES.get(shape.variant)?.letter()))
    }

    fn columns(&self, model: &MeasuredParts, shape: &Shape) -> Vec<Column> {
        let axis = AXES[shape.variant.min(1)];
        vec![model.column(|r| {
            if r.axis == axis {
                um_from_mm(r.position[axis.index()]) * r.position.z
            } else {
                0.0
            }
        })]
    }
}
