//! One part lies otherwise than the rest.

use super::MeasuredParts;
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Parameter, Shape};

/// See the head of the file.
pub(super) struct BadPart;

impl Effect<MeasuredParts> for BadPart {
    fn name(&self) -> &str {
        "bad-part"
    }

    fn about(&self) -> About {
        About {
            physics: "one part lies otherwise than the rest: a chip under it, a slipped clamp",
            confirm: "look at the part and its clamping; measure it again",
            source: "rigid translation of one part",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("x", "um", 1e3),
            Parameter::symmetric("y", "um", 1e3),
        ]
    }

    fn grid(&self, model: &MeasuredParts) -> Vec<Shape> {
        (0..model.parts().len()).map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &MeasuredParts, shape: &Shape) -> Option<String> {
        Some(format!("part {}", model.parts().get(shape.variant)?))
    }

    fn columns(&self, model: &MeasuredParts, shape: &Shape) -> Vec<Column> {
        let Some(part) = model.parts().get(shape.variant) else {
            return Vec::new();
        };
        [Axis::X, Axis::Y]
            .map(|axis| model.column(|r| f64::from(u8::from(r.axis == axis && r.part == *part))))
            .into()
    }
}
