//! The artefact moves along its axis when the spindle turns.

use super::{FirstOrder, SETTLING, settled_at};
use crate::model::{About, Column, Effect, Link, Parameter, Shape};

/// See the head of the file.
pub(super) struct ReversalShift;

impl Effect<FirstOrder> for ReversalShift {
    fn name(&self) -> &str {
        "reversal-shift"
    }

    fn about(&self) -> About {
        About {
            physics: "the artefact sits at another axial position after the reversal, so its form returns shifted in the second spindle position",
            confirm: "touch the end face of the artefact with an indicator in both spindle positions",
            source: "first-order Taylor expansion of S(x - shift) in the second spindle position",
        }
    }

    fn link(&self) -> Link {
        Link::Stylus
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "shift",
            unit: "mm",
            low: -20.0,
            high: 20.0,
        }]
    }

    fn grid(&self, _model: &FirstOrder) -> Vec<Shape> {
        vec![SETTLING]
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let shift = shape.values.first().copied().unwrap_or(0.0);
        vec![model.of_cell(|_, place| {
            if model.channel(place).spindle_sign() > 0.0 {
                0.0
            } else {
                -model.side_chord(place, -shift)
            }
        })]
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        settled_at(shape, amplitudes)
    }
}
