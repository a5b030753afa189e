//! The stylus leaves the crest of a cylindrical bar sideways.
//!
//! Slide and bar are askew across the line of the indicator, so the stylus stands beside the crest by
//! y = y₀ + x (θ + p ω): y₀ of the indicator, θ of the slide and p ω of the bar, which turns with the
//! spindle; it loses y²/2R. What is the same in both spindle positions is form. What is left is the
//! square of the position with the sign of the spindle position, and where y₀ is not zero a line that
//! differs by channel, which is a cone. Free: the loss by the square, and by that line.

use super::{FirstOrder, part_of_travel};
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file. Variants: beside the crest by the skew alone, [`BESIDE`].
pub(super) struct OffCrest;

/// Variant of indicators that stand beside the crest at mid travel too.
const BESIDE: usize = 1;

impl Effect<FirstOrder> for OffCrest {
    fn name(&self) -> &str {
        "off-crest"
    }

    fn about(&self) -> About {
        About {
            physics: "slide and bar are askew sideways, so the stylus wanders off the crest of the bar, by more in one spindle position than in the other",
            confirm: "move the indicator across the bar at both ends and read how far it stands from the highest point",
            source: "arrow height of a circle, y^2 / 2R, with y = y0 + x (theta + p omega)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let mut all = vec![Parameter::symmetric("loss", "um", 500.0)];
        if shape.variant == BESIDE {
            all.push(Parameter::symmetric("loss-along-line", "um", 500.0));
        }
        all
    }

    fn relatives(&self, _model: &FirstOrder, shape: &Shape) -> Vec<Shape> {
        vec![Shape::variant(BESIDE - shape.variant.min(BESIDE))]
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let square = Column::from_places(model.places(), |_, place| {
            -model.channel(place).spindle_sign() * part_of_travel(model, place.x).powi(2)
        });
        if shape.variant != BESIDE {
            return vec![square];
        }
        // Of the lines of the four channels only the sum, a cone, is not taken up by forms and tilts.
        let line = Column::from_places(model.places(), |_, place| part_of_travel(model, place.x));
        vec![square, line]
    }

    fn variant_name(&self, _model: &FirstOrder, shape: &Shape) -> Option<String> {
        (shape.variant == BESIDE).then(|| "beside the crest at mid travel too".to_owned())
    }
}
