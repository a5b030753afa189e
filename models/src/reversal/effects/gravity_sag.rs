//! The artefact sags by its weight, in the same direction in both spindle positions.

use super::Linearised;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct GravitySag;

impl Effect<Linearised> for GravitySag {
    fn name(&self) -> &str {
        "gravity-sag"
    }

    fn about(&self) -> About {
        About {
            physics: "the artefact bends under its weight and does not turn its bend with the spindle, exactly as the slide's form would appear",
            confirm: "compute the sag from section and overhang, or repeat with the axis vertical",
            source: "cantilever under its own weight, Roark's Formulas for Stress and Strain",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("end-sag", "um", -1000.0, 1000.0)]
    }

    fn absorbed(&self) -> bool {
        true
    }

    fn columns(&self, model: &Linearised, _shape: &Shape) -> Vec<Column> {
        let vertical = model.present().iter().any(|s| s.phi[1] != 0.0);
        vec![Column::from_places(model.places(), |_, place| {
            let u = place.x / model.travel();
            let sag = u * u * (6.0 - 4.0 * u + u * u) / 3.0;
            // Downwards where an indicator sees it; across, no reversal sees it at all.
            let [across, up] = model.seat(place).phi;
            if vertical { -up * sag } else { across * sag }
        })]
    }
}
