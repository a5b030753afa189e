//! A probe drifts against the first while the scans are taken.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Drift;

impl Effect<FourierScans> for Drift {
    fn name(&self) -> &str {
        "drift"
    }

    fn about(&self) -> About {
        About {
            physics: "the probes or their holder settle to a new temperature while the scans are taken, fast at first",
            confirm: "stand still for as long as a scan takes and record all probes",
            source: "first-order response d (1 - exp(-t / tau)) from the zero of each scan; ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("drift", "um", 1e3)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between(
            "log-time-constant",
            "ln of the duration",
            -4.0,
            3.0,
        )]
    }

    fn grid(&self, _model: &FourierScans) -> Vec<Shape> {
        [0.02f64, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.4]
            .map(|part| Shape {
                variant: 0,
                values: vec![part.ln()],
                steps: vec![0.3],
            })
            .to_vec()
    }

    fn allowed(&self, _model: &FourierScans, shape: &Shape) -> bool {
        let allowed = -4.0..=3.0;
        shape
            .values
            .first()
            .is_some_and(|log| allowed.contains(log))
    }

    fn columns(&self, model: &FourierScans, shape: &Shape) -> Vec<Column> {
        let Some(&log_constant) = shape.values.first() else {
            return Vec::new();
        };
        let constant = log_constant.exp();
        let whole = -(-1.0 / constant).exp_m1();
        vec![Column::from_places(model.places(), |_, place| {
            -(-model.moment(place) / constant).exp_m1() / whole
        })]
    }
}
