//! The slide lags behind its command by half the backlash, to either side.

use super::{FirstOrder, SETTLING, settled_at};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Place, Shape};

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
            source: "ISO 230-2 reversal value; I(x -/+ B/2)",
        }
    }

    fn link(&self) -> Link {
        Link::Slide
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "backlash",
            unit: "mm",
            low: -0.5,
            high: 10.0,
        }]
    }

    fn grid(&self, _model: &FirstOrder) -> Vec<Shape> {
        vec![SETTLING]
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let lost = shape.values.first().copied().unwrap_or(0.0);
        let change = |k: usize, place: &Place| {
            let half = -0.5 * place.direction;
            half * model.reading_chord(k, half * lost)
        };
        vec![if model.lies_beneath() {
            Column::from_places(model.places(), change)
        } else {
            model.of_cell(change)
        }]
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        settled_at(shape, amplitudes)
    }
}
