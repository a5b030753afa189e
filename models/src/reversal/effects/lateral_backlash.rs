//! The slide runs on another line forward than backward.
//!
//! It leans to the other side of its guide when it turns round, and may swing with it: a shift and a
//! turn that change their sign with the direction of travel, towards the indicator as the slide's
//! form is (the sign of M). Where the tilts outweigh the slopes of the forms, a play of the
//! indicators (`hysteresis`) looks the same. Free: the shift at mid travel and the turn.

use super::{FirstOrder, part_of_travel};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};

/// See the head of the file.
pub(super) struct LateralBacklash;

impl Effect<FirstOrder> for LateralBacklash {
    fn name(&self) -> &str {
        "lateral-backlash"
    }

    fn about(&self) -> About {
        About {
            physics: "the slide runs on another line forward than backward: it leans to the other side of its guide, and may swing",
            confirm: "reverse the axis under an indicator that looks across the travel and read the step",
            source: "ISO 230-1 straightness in both directions; half the difference, with the sign of M",
        }
    }

    fn link(&self) -> Link {
        Link::Slide
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        // The turn is told by what it makes at the ends of the travel.
        ["step", "step-of-turn"]
            .map(|name| Parameter::symmetric(name, "um", 100.0))
            .to_vec()
    }

    fn columns(&self, model: &FirstOrder, _shape: &Shape) -> Vec<Column> {
        let with = |along: &dyn Fn(f64) -> f64| {
            Column::from_places(model.places(), |_, place| {
                let sign = model.channel(place).indicator_sign() * place.direction;
                0.5 * sign * along(place.x)
            })
        };
        vec![with(&|_| 1.0), with(&|x| part_of_travel(model, x))]
    }
}
