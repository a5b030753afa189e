//! The stylus leaves the crest of a cylindrical bar sideways.
//!
//! Slide and bar are askew across the line of the indicator, so the stylus wanders off the crest by
//! y = x (θ + p ω), θ of the slide and p ω of the bar, which turns with the spindle; it loses
//! y²/2R. What is the same in both spindle positions is form, and a straight part is a cone; what is
//! left is the square of the position with the sign of the spindle position. Free: its size.

use super::{FirstOrder, part_of_travel};
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct OffCrest;

impl Effect<FirstOrder> for OffCrest {
    fn name(&self) -> &str {
        "off-crest"
    }

    fn about(&self) -> About {
        About {
            physics: "slide and bar are askew sideways, so the stylus wanders off the crest of the bar, by more in one spindle position than in the other",
            confirm: "move the indicator across the bar at both ends and read how far it stands from the highest point",
            source: "arrow height of a circle, y^2 / 2R, with y = x (theta + p omega)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("loss", "um", 500.0)]
    }

    fn columns(&self, model: &FirstOrder, _shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            -model.channel(place).spindle_sign() * part_of_travel(model, place.x).powi(2)
        })]
    }
}
