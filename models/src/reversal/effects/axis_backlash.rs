//! The slide lags behind its command by half the backlash, to either side.

use super::FirstOrder;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct AxisBacklash;

impl Effect<FirstOrder> for AxisBacklash {
    fn name(&self) -> &str {
        "axis-backlash"
    }

    fn about(&self) -> About {
        About {
            physics: "the slide stands half the backlash behind its command, so form and slope return shifted between forward and backward",
            confirm: "reverse the axis under a dial gauge or laser and read the lost motion",
            source: "ISO 230-2 reversal value; first-order Taylor expansion of I(x -/+ B/2)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "backlash",
            unit: "mm",
            low: -0.5,
            high: 10.0,
        }]
    }

    fn columns(&self, model: &FirstOrder, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            -0.5 * place.direction * model.reading_slope(place)
        })]
    }
}
