//! All parts are measured in a turned frame.

use super::MeasuredParts;
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Parameter, Shape};
use crate::units::um_from_mm;

/// See the head of the file.
pub(super) struct DatumRotation;

impl Effect<MeasuredParts> for DatumRotation {
    fn name(&self) -> &str {
        "datum-rotation"
    }

    fn about(&self) -> About {
        About {
            physics: "all parts are measured in a frame turned against that of the machine",
            confirm: "align the measurement to another edge and see the deviations turn",
            source: "rigid rotation about Z: (-y, x)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("angle", "rad", 1e-2)]
    }

    fn columns(&self, model: &MeasuredParts, _shape: &Shape) -> Vec<Column> {
        vec![model.column(|r| match r.axis {
            Axis::X => -um_from_mm(r.position.y),
            Axis::Y => um_from_mm(r.position.x),
            Axis::Z => 0.0,
        })]
    }
}
