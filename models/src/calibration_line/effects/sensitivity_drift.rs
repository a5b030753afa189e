//! The slope drifts while the sets are taken.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct SensitivityDrift;

impl Effect<CalibrationLine> for SensitivityDrift {
    fn name(&self) -> &str {
        "sensitivity-drift"
    }

    fn about(&self) -> About {
        About {
            physics: "the sensitivity drifts towards equilibrium while the sets are taken: the transducer or its amplifier warms up",
            confirm: "switch on an hour before, and repeat the first set at the end",
            source: "slope times the first-order response 1 - exp(-t / tau) to a change of temperature",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-full-scale", "y", 1e6)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between(
            "log-time-constant",
            "ln of the duration",
            -4.0,
            3.0,
        )]
    }

    fn grid(&self, _model: &CalibrationLine) -> Vec<Shape> {
        [0.05f64, 0.1, 0.2, 0.4, 0.8, 1.6, 20.0]
            .map(|part| Shape {
                variant: 0,
                values: vec![part.ln()],
                // Twenty times the duration stands for a straight line.
                steps: vec![if part > 5.0 { 0.0 } else { 0.3 }],
            })
            .to_vec()
    }

    fn allowed(&self, _model: &CalibrationLine, shape: &Shape) -> bool {
        let allowed = -4.0..=3.0;
        shape
            .values
            .first()
            .is_some_and(|log| allowed.contains(log))
    }

    fn columns(&self, model: &CalibrationLine, shape: &Shape) -> Vec<Column> {
        let Some(&log_constant) = shape.values.first() else {
            return Vec::new();
        };
        let (total, reach) = (model.duration(), model.reach());
        let constant = log_constant.exp() * total;
        // Per unit of the drift over the whole calibration, so that the straight line is the limit.
        let whole = -(-total / constant).exp_m1();
        vec![Column::from_places(model.places(), |_, place| {
            place.x / reach * -(-place.time / constant).exp_m1() / whole
        })]
    }
}
