//! The probed point lies half a thickness from the tilted axis.

use super::{Linearised, SETTLING};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Place, Shape};

/// See the head of the file.
pub(super) struct ThicknessShift;

impl Effect<Linearised> for ThicknessShift {
    fn name(&self) -> &str {
        "thickness-shift"
    }

    fn about(&self) -> About {
        About {
            physics: "the probe touches the tilted artefact half a thickness off its axis, so near and far probe points lie thickness times tilt apart",
            confirm: "measure the thickness and give it in the set-up, or align the artefact better and repeat",
            source: "exact geometry of a tilted artefact, u = x + h psi to first order",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Slide
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("thickness", "mm", 0.0, 500.0)]
    }

    fn grid(&self, _model: &Linearised) -> Vec<Shape> {
        vec![SETTLING]
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let thickness = shape.values.first().copied().unwrap_or(0.0);
        let change = |k: usize, place: &Place| {
            let per_mm = 0.5 * model.tilt(place);
            per_mm * model.probed_chord(k, per_mm * thickness)
        };
        vec![if model.lies_beneath() {
            Column::from_places(model.places(), change)
        } else {
            model.of_cell(change)
        }]
    }

    fn open(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let thickness = shape.values.first().copied().unwrap_or(0.0);
        model.between_positions(|_, place| [0.0, 0.5 * model.tilt(place) * thickness])
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        shape.settled_at(amplitudes)
    }
}
