//! A part of the response is used up within the range.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// A knee beyond half of the range does not level off inside it: that is a bend, not a saturation.
const LAST: f64 = 0.5;

/// See the head of the file.
pub(super) struct Saturation;

impl Effect<CalibrationLine> for Saturation {
    fn name(&self) -> &str {
        "saturation"
    }

    fn about(&self) -> About {
        About {
            physics: "a part of the response is used up beyond a knee inside the range: a stop, a magnetic core, an amplifier near its supply",
            confirm: "calibrate densely below and above the knee, and beyond the range, where the slope no longer changes",
            source: "first-order approach to a limit, 1 - exp(-x / k)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("lost-reading", "y", 1e6)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("knee", "of full scale", 0.02, LAST)]
    }

    fn grid(&self, _model: &CalibrationLine) -> Vec<Shape> {
        [0.03f64, 0.06, 0.12, 0.2, 0.3, 0.4, LAST]
            .map(|knee| Shape {
                variant: 0,
                values: vec![knee],
                steps: vec![0.3 * knee],
            })
            .to_vec()
    }

    fn allowed(&self, _model: &CalibrationLine, shape: &Shape) -> bool {
        shape
            .values
            .first()
            .is_some_and(|knee| (0.02..=LAST).contains(knee))
    }

    fn columns(&self, model: &CalibrationLine, shape: &Shape) -> Vec<Column> {
        let Some(&knee) = shape.values.first() else {
            return Vec::new();
        };
        let reach = model.reach();
        vec![Column::from_places(model.places(), |_, place| {
            let t = place.x.abs() / reach;
            -place.x.signum() * (-t / knee).exp_m1()
        })]
    }
}
