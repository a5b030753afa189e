//! An axis that does not run straight.

use super::MeasuredParts;
use super::along_axes::{ORDERS, bend, is_read};
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Parameter, Shape};

/// See the head of the file.
pub(super) struct Straightness;

impl Straightness {
    /// Deviation, axis of motion and order of each variant.
    fn variants(model: &MeasuredParts) -> Vec<(Axis, Axis, &'static str, usize)> {
        let mut variants = Vec::new();
        for deviation in Axis::ALL.into_iter().filter(|axis| is_read(model, *axis)) {
            for along in Axis::ALL.into_iter().filter(|axis| *axis != deviation) {
                for (name, order) in ORDERS {
                    if bend(model, along, order).is_some() {
                        variants.push((deviation, along, name, order));
                    }
                }
            }
        }
        variants
    }
}

impl Effect<MeasuredParts> for Straightness {
    fn name(&self) -> &str {
        "straightness"
    }

    fn about(&self) -> About {
        About {
            physics: "an axis does not run straight: its guide is bent, or sags under what it carries",
            confirm: "measure its straightness with a straightedge turned over, or with a laser",
            source: "EYX, EZX, EXY, EZY, EXZ, EYZ; ISO 230-1",
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
        let (deviation, along, name, _) = *Self::variants(model).get(shape.variant)?;
        Some(format!("E{}{}, {name}", deviation.letter(), along.letter()))
    }

    fn columns(&self, model: &MeasuredParts, shape: &Shape) -> Vec<Column> {
        let variants = Self::variants(model);
        let found = variants.get(shape.variant);
        let column = found.and_then(|(deviation, along, _, order)| {
            let curve = bend(model, *along, *order)?;
            Some(model.column(|r| match r.axis == *deviation {
                true => curve(&r.position),
                false => 0.0,
            }))
        });
        vec![column.unwrap_or_else(|| model.column(|_| 0.0))]
    }
}
