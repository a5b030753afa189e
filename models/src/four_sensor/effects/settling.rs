//! One sensor settles while the travels are taken.

use super::FourSensors;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Settling;

impl Effect<FourSensors> for Settling {
    fn name(&self) -> &str {
        "settling"
    }

    fn about(&self) -> About {
        About {
            physics: "one sensor or its holder settles to a new temperature, fast at first, over all travels",
            confirm: "stand still for as long as the travels took and record that sensor",
            source: "first-order response d (1 - exp(-t / tau)) of one sensor; ISO 230-3",
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

    fn grid(&self, _model: &FourSensors) -> Vec<Shape> {
        let parts = [0.03f64, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0];
        let of = |variant: usize| {
            parts.map(|part| Shape {
                variant,
                values: vec![part.ln()],
                steps: vec![0.3],
            })
        };
        (0..4).flat_map(of).collect()
    }

    fn allowed(&self, _model: &FourSensors, shape: &Shape) -> bool {
        let allowed = -4.0..=3.0;
        shape
            .values
            .first()
            .is_some_and(|log| allowed.contains(log))
    }

    fn columns(&self, model: &FourSensors, shape: &Shape) -> Vec<Column> {
        let Some(&log_constant) = shape.values.first() else {
            return Vec::new();
        };
        let constant = log_constant.exp();
        let whole = -(-1.0 / constant).exp_m1();
        vec![Column::from_places(model.places(), |_, place| {
            let own = f64::from(u8::from(place.channel == shape.variant));
            -own * (-model.moment(place) / constant).exp_m1() / whole
        })]
    }

    fn variant_name(&self, _model: &FourSensors, shape: &Shape) -> Option<String> {
        Some(format!("sensor {}", shape.variant + 1))
    }
}
