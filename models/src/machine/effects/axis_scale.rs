//! The scale of one axis was another when the parts were made.

use super::MeasuredParts;
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Parameter, Shape};
use crate::units::um_from_mm;

/// Axes whose scale can change in a plane.
const AXES: [Axis; 2] = [Axis::X, Axis::Y];

/// See the head of the file.
pub(super) struct AxisScale;

impl Effect<MeasuredParts> for AxisScale {
    fn name(&self) -> &str {
        "axis-scale"
    }

    fn about(&self) -> About {
        About {
            physics: "the scale of one axis was another when the parts were made: a warm screw, a changed compensation",
            confirm: "run the axis against a laser at the temperature of machining",
            source: "linear term of EXX or EYY; ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("scale", "1", 1e-3)]
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
                um_from_mm(r.position[axis.index()])
            } else {
                0.0
            }
        })]
    }
}
