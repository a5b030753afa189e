//! The artefact is a cone: both surfaces fall away from its axis.

use super::Linearised;
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};

/// See the head of the file.
pub(super) struct Taper;

impl Effect<Linearised> for Taper {
    fn name(&self) -> &str {
        "taper"
    }

    fn about(&self) -> About {
        About {
            physics: "the diameter changes along the artefact, so every channel climbs alike",
            confirm: "measure the diameter at both ends with a micrometer",
            source: "rigid-body geometry of a frustum between two indicators (contrast + + + + of the four slopes)",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Stylus
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("half-angle", "rad", -0.1, 0.1)]
    }

    fn columns(&self, model: &Linearised, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            place.x * 1e3
        })]
    }
}
