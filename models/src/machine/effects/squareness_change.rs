//! X and Y stood at another angle when the parts were made.

use super::MeasuredParts;
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Parameter, Shape};
use crate::units::um_from_mm;

/// See the head of the file.
pub(super) struct SquarenessChange;

impl Effect<MeasuredParts> for SquarenessChange {
    fn name(&self) -> &str {
        "squareness-change"
    }

    fn about(&self) -> About {
        About {
            physics: "the angle between X and Y was another when the parts were made",
            confirm: "measure the squareness of X and Y again, at the load of machining",
            source: "shear of X by y; NISTIR 6868, equation (9)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("angle", "rad", 1e-2)]
    }

    fn columns(&self, model: &MeasuredParts, _shape: &Shape) -> Vec<Column> {
        vec![model.column(|r| match r.axis {
            Axis::X => -um_from_mm(r.position.y),
            Axis::Y | Axis::Z => 0.0,
        })]
    }
}
