//! One set reads higher than the others.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct SetOffset;

impl Effect<CalibrationLine> for SetOffset {
    fn name(&self) -> &str {
        "set-offset"
    }

    fn about(&self) -> About {
        About {
            physics: "one set reads higher than the others: the zero was set anew, the load was remounted",
            confirm: "read the zero before and after every set",
            source: "a constant for each set",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("offset", "y", 1e6)]
    }

    fn grid(&self, model: &CalibrationLine) -> Vec<Shape> {
        // With two sets the offset of the one is that of the other, turned round.
        let sets = model.traces().len();
        let different = if sets == 2 { 1..2 } else { 0..sets };
        if sets < 2 {
            return Vec::new();
        }
        different.map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &CalibrationLine, shape: &Shape) -> Option<String> {
        let trace = model.traces().get(shape.variant)?;
        let place = model.places().get(trace.start)?;
        Some(format!("set {}", place.repeat))
    }

    fn columns(&self, model: &CalibrationLine, shape: &Shape) -> Vec<Column> {
        model
            .traces()
            .get(shape.variant)
            .map(|trace| Column {
                rows: trace.clone().collect(),
                values: vec![1.0; trace.len()],
            })
            .into_iter()
            .collect()
    }
}
