//! The part lay otherwise in one pass.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct PartMoved;

impl Effect<CirclePoints> for PartMoved {
    fn name(&self) -> &str {
        "part-moved"
    }

    fn about(&self) -> About {
        About {
            physics: "the part, or the zero of the axes, moved between two passes, so that one pass has a centre of its own",
            confirm: "clamp anew, measure a reference point before and after every pass",
            source: "a centre for each pass",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("along-x", "um", 1e5),
            Parameter::symmetric("along-y", "um", 1e5),
        ]
    }

    fn grid(&self, model: &CirclePoints) -> Vec<Shape> {
        // With two passes the place of the one is that of the other, turned round.
        let passes = model.traces().len();
        let different = match passes {
            0 | 1 => 0..0,
            2 => 1..2,
            _ => 0..passes,
        };
        different.map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &CirclePoints, shape: &Shape) -> Option<String> {
        let trace = model.traces().get(shape.variant)?;
        let place = model.places().get(trace.start)?;
        Some(format!("repeat {}", place.repeat))
    }

    fn columns(&self, model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        let Some(trace) = model.traces().get(shape.variant) else {
            return Vec::new();
        };
        let angle = |k: usize| CirclePoints::angle(&model.places()[k]);
        [f64::cos, f64::sin]
            .map(|along| Column {
                rows: trace.clone().collect(),
                values: trace.clone().map(|k| along(angle(k))).collect(),
            })
            .into()
    }
}
