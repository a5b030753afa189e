//! Machine or indicators drift while the traces are taken.

use super::FirstOrder;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file. Variants: the spindle axis moves against the slide (near and far see
/// opposite signs), or both indicators drift alike.
pub(super) struct ThermalDrift;

impl Effect<FirstOrder> for ThermalDrift {
    fn name(&self) -> &str {
        "thermal-drift"
    }

    fn about(&self) -> About {
        About {
            physics: "spindle, slide or indicators drift towards thermal equilibrium while the traces are taken",
            confirm: "leave the indicators on the artefact at one position for as long as the test took and record them",
            source: "first-order thermal response d (1 - exp(-t / tau)); ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "drift",
            unit: "um",
            low: -500.0,
            high: 500.0,
        }]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "log-time-constant",
            unit: "ln s",
            low: -5.0,
            high: 20.0,
        }]
    }

    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let total = model.duration();
        (0..2)
            .flat_map(|variant| {
                [0.03f64, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0, 20.0].map(|part| Shape {
                    variant,
                    values: vec![(part * total).ln()],
                    // Beyond twenty times the duration a drift is a straight line.
                    steps: vec![if part > 5.0 { 0.0 } else { 0.2 }],
                })
            })
            .collect()
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let Some(log_constant) = shape.values.first() else {
            return Vec::new();
        };
        let total = model.duration();
        let constant = log_constant.exp().max(1e-3 * total);
        // Per unit of the drift over the whole test, so that the straight line is the limit.
        let whole = -(-total / constant).exp_m1();
        vec![Column::from_places(model.places(), |_, place| {
            let sign = if shape.variant == 0 {
                model.channel(place).indicator_sign()
            } else {
                1.0
            };
            -sign * (-place.time / constant).exp_m1() / whole
        })]
    }

    fn allowed(&self, model: &FirstOrder, shape: &Shape) -> bool {
        shape.values.first().is_some_and(|log_constant| {
            let part = log_constant.exp() / model.duration();
            part > 0.005 && part < 50.0
        })
    }

    fn variant_name(&self, _model: &FirstOrder, shape: &Shape) -> Option<String> {
        Some(
            if shape.variant == 0 {
                "spindle axis against slide"
            } else {
                "both indicators alike"
            }
            .to_owned(),
        )
    }
}
