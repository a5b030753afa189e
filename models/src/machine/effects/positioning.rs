//! An axis whose positions are off by more than a scale.

use super::MeasuredParts;
use super::along_axes::{ORDERS, bend, is_read};
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Parameter, Shape};

/// See the head of the file.
pub(super) struct Positioning;

impl Positioning {
    /// Axis and order of each variant.
    fn variants(model: &MeasuredParts) -> Vec<(Axis, &'static str, usize)> {
        let axes = Axis::ALL.into_iter().filter(|axis| is_read(model, *axis));
        axes.flat_map(|axis| ORDERS.map(|(name, order)| (axis, name, order)))
            .filter(|(axis, _, order)| bend(model, *axis, *order).is_some())
            .collect()
    }
}

impl Effect<MeasuredParts> for Positioning {
    fn name(&self) -> &str {
        "positioning"
    }

    fn about(&self) -> About {
        About {
            physics: "the positions of an axis are off by a curve: a screw that warms along its length, a scale that is bent or held at both ends",
            confirm: "run the axis against a laser or a step gauge",
            source: "EXX, EYY, EZZ beyond their linear term; ISO 230-1",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("deviation-at-the-end", "um", 1e3)]
    }

    fn grid(&self, model: &MeasuredParts) -> Vec<Shape> {
        (0..Self::variants(model).len())
            .map(Shape::variant)
            .collect()
    }

    fn variant_name(&self, model: &MeasuredParts, shape: &Shape) -> Option<String> {
        let (axis, name, _) = *Self::variants(model).get(shape.variant)?;
        let letter = axis.letter();
        Some(format!("E{letter}{letter}, {name}"))
    }

    fn columns(&self, model: &MeasuredParts, shape: &Shape) -> Vec<Column> {
        let variants = Self::variants(model);
        let found = variants.get(shape.variant);
        let column = found.and_then(|(axis, _, order)| {
            let curve = bend(model, *axis, *order)?;
            Some(model.column(|r| match r.axis == *axis {
                true => curve(&r.position),
                false => 0.0,
            }))
        });
        vec![column.unwrap_or_else(|| model.column(|_| 0.0))]
    }
}
