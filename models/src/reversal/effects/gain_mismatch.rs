//! Near and far indicator have different gains.

use super::FirstOrder;
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};

/// See the head of the file.
pub(super) struct GainMismatch;

impl Effect<FirstOrder> for GainMismatch {
    fn name(&self) -> &str {
        "gain-mismatch"
    }

    fn about(&self) -> About {
        About {
            physics: "one indicator reads a larger part of the same displacement than the other",
            confirm: "swap the indicators, or calibrate both against the same gauge blocks",
            source: "I (1 + i g / 2): near and far gain differ by g",
        }
    }

    fn link(&self) -> Link {
        Link::Sensor
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "mismatch",
            unit: "1",
            low: -0.2,
            high: 0.2,
        }]
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &FirstOrder, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |k, place| {
            0.5 * model.channel(place).indicator_sign()
                * (model.smooth_reading(k) - model.mid_reading(place))
        })]
    }
}
