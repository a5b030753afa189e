//! Both indicators have the same wrong gain.

use super::Linearised;
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};

/// See the head of the file.
pub(super) struct CommonGain;

impl Effect<Linearised> for CommonGain {
    fn name(&self) -> &str {
        "common-gain"
    }

    fn about(&self) -> About {
        About {
            physics: "both indicators read the same part too much or too little, which scales every form and tilt alike",
            confirm: "calibrate one indicator against gauge blocks",
            source: "I (1 + g): the whole model is linear in g",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Sensor
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("gain", "1", -0.5, 0.5)]
    }

    fn absorbed(&self) -> bool {
        true
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &Linearised, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |k, place| {
            model.smooth_reading(k) - model.mid_reading(place)
        })]
    }
}
