//! The slide travels further than it says.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct TravelScale;

impl Effect<FourierScans> for TravelScale {
    fn name(&self) -> &str {
        "travel-scale"
    }

    fn about(&self) -> About {
        About {
            physics: "the slide travels further or less far than its scale says, so that the probes read other places of the workpiece",
            confirm: "measure the positioning of the slide with a laser",
            source: "f(x + s x) - f(x + s x + d)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("scale", "1", 0.05)]
    }

    fn columns(&self, model: &FourierScans, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            place.x * (model.slope_here(place) - model.slope_there(place))
        })]
    }
}
