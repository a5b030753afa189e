//! One set has another slope.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct SetSlope;

impl Effect<CalibrationLine> for SetSlope {
    fn name(&self) -> &str {
        "set-slope"
    }

    fn about(&self) -> About {
        About {
            physics: "the slope of one set is another: another temperature, another supply, the load mounted askew",
            confirm: "record temperature and supply with each set and repeat the one that differs",
            source: "a slope for each set; ISO 376 reproducibility in turned positions",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-full-scale", "y", 1e6)]
    }

    fn grid(&self, model: &CalibrationLine) -> Vec<Shape> {
        // With two sets the slope of the one is that of the other, turned round.
        let sets = model.traces().len();
        let different = match sets {
            0 | 1 => 0..0,
            2 => 1..2,
            _ => 0..sets,
        };
        different.map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &CalibrationLine, shape: &Shape) -> Option<String> {
        let trace = model.traces().get(shape.variant)?;
        let place = model.places().get(trace.start)?;
        Some(format!("set {}", place.repeat))
    }

    fn columns(&self, model: &CalibrationLine, shape: &Shape) -> Vec<Column> {
        let Some(trace) = model.traces().get(shape.variant) else {
            return Vec::new();
        };
        let slope = |k: usize| model.places()[k].x / model.reach();
        vec![Column {
            rows: trace.clone().collect(),
            values: trace.clone().map(slope).collect(),
        }]
    }
}
