//! The spindle is not turned by exactly half a turn.
//!
//! A bar that is askew sideways by ω to the spindle axis shows a part ω δ of it towards the
//! indicators when the second position is off by δ. It looks like a tilt of slide and artefact, so
//! to first order it is absorbed, and half of it goes into α. Free: the product ω δ.

use super::FirstOrder;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct IndexingError;

impl Effect<FirstOrder> for IndexingError {
    fn name(&self) -> &str {
        "indexing-error"
    }

    fn about(&self) -> About {
        About {
            physics: "the second spindle position is not exactly half a turn from the first, so a sideways tilt of the artefact shows in it",
            confirm: "check the half turn with a level or an angle encoder, and align the artefact sideways too",
            source: "rotation of the tilt vector of the artefact by the error of the half turn",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("tilt", "rad", 0.01)]
    }

    fn absorbed(&self) -> bool {
        true
    }

    fn columns(&self, model: &FirstOrder, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            let channel = model.channel(place);
            let second = f64::from(channel.spindle_sign() < 0.0);
            second * channel.side_sign() * place.x * 1e3
        })]
    }
}
