//! The stylus ball does not reach into the artefact's valleys.

use super::Linearised;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct TipRadius;

impl Effect<Linearised> for TipRadius {
    fn name(&self) -> &str {
        "tip-radius"
    }

    fn about(&self) -> About {
        About {
            physics: "the stylus ball traces the form of the artefact smoothed by its radius, the same in both spindle positions",
            confirm: "repeat with a stylus of another radius",
            source: "height of a ball rolling on a slope: r S'^2 / 2",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("radius", "mm", 0.0, 50.0)]
    }

    fn absorbed(&self) -> bool {
        true
    }

    fn columns(&self, model: &Linearised, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            let slope = model.side_slope(place) * 1e-3;
            0.5e3 * slope * slope
        })]
    }
}
