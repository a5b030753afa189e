//! The stylus leaves the crest of a cylindrical bar sideways.
//!
//! Slide and bar are askew across the line of the indicator, so the stylus stands beside the crest by
//! y = y₀ + x (α·t(φ) + γ·t(ψ)), t(a) = (−sin a, cos a): y₀ of the indicator, α of the slide and γ of the
//! bar, which turns with the spindle; it loses y²/2R. The square of γ·t(ψ) is form of a side, and that of
//! α·t(φ) the same in all positions; what is left is the square of the position with α·t(φ) γ·t(ψ), of the
//! four channels with the sign of the spindle position. Where the stylus stands beside the crest at mid
//! travel too a line comes with it: of the four channels a cone counts, of designs α·t(φ) γ·t(ψ) again, as
//! stylus, slide and bar meet the crest elsewhere than at mid travel. Free: the loss by the square for each
//! product of α and γ that channels see, and by the line.

use super::{Linearised, part_of_travel};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Place, Shape};
use crate::reversal::diagnosable::{Arrangement, Seat};

/// See the head of the file. Variants: beside the crest by the skew alone, [`BESIDE`].
pub(super) struct OffCrest {
    /// Components of t(φ) and t(ψ) whose product some channel sees.
    products: Vec<[usize; 2]>,
    four: bool,
}

/// Variant of indicators that stand beside the crest at mid travel too.
const BESIDE: usize = 1;

impl OffCrest {
    pub fn new(channels: &Arrangement) -> Self {
        // Of the four channels that along the vertical, whether or not both positions are there.
        let all = [[1, 1], [0, 0], [0, 1], [1, 0]];
        let sees = |own: &[usize; 2]| channels.seats().iter().any(|s| across(s, *own) != 0.0);
        Self {
            products: all.into_iter().filter(sees).collect(),
            four: channels.is_four(),
        }
    }
}

/// The product of components of t(φ) and t(ψ): by (1, 1) cos φ cos ψ, by (0, 0) sin φ sin ψ.
fn across(seat: &Seat, [of_slide, of_bar]: [usize; 2]) -> f64 {
    let t = |angle: [f64; 2]| [-angle[1], angle[0]];
    t(seat.phi)[of_slide] * t(seat.psi)[of_bar]
}

impl Effect<Linearised> for OffCrest {
    fn name(&self) -> &str {
        "off-crest"
    }

    fn about(&self) -> About {
        About {
            physics: "slide and bar are askew sideways, so the stylus wanders off the crest of the bar, by more in one spindle position than in another",
            confirm: "move the indicator across the bar at both ends and read how far it stands from the highest point",
            source: "arrow height of a circle, y^2 / 2R, with y = y0 + x (alpha t(phi) + gamma t(psi))",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Stylus
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let name = |own: &[usize; 2]| match (self.products.len(), own) {
            (1, _) => "loss",
            (_, [1, 1]) => "loss-vertical",
            (_, [0, 0]) => "loss-horizontal",
            (_, [0, _]) => "loss-horizontal-vertical",
            _ => "loss-vertical-horizontal",
        };
        let loss = |own: &[usize; 2]| Parameter::symmetric(name(own), "um", 500.0);
        let mut all: Vec<Parameter> = self.products.iter().map(loss).collect();
        if shape.variant == BESIDE {
            let lines = if self.four { 1 } else { self.products.len() };
            let line = Parameter::symmetric("loss-along-line", "um", 500.0);
            all.extend(std::iter::repeat_n(line, lines));
        }
        all
    }

    fn relatives(&self, _model: &Linearised, shape: &Shape) -> Vec<Shape> {
        vec![Shape::variant(BESIDE - shape.variant.min(BESIDE))]
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let of = |own: &[usize; 2], power: i32| {
            Column::from_places(model.places(), |_, place| {
                -across(model.seat(place), *own) * part_of_travel(model, place.x).powi(power)
            })
        };
        let mut columns: Vec<Column> = self.products.iter().map(|own| of(own, 2)).collect();
        if shape.variant != BESIDE {
            return columns;
        }
        if self.four {
            // Of the lines of the four channels only the sum, a cone, is not taken up by forms and tilts.
            let line = |_: usize, place: &Place| part_of_travel(model, place.x);
            columns.push(Column::from_places(model.places(), line));
        } else {
            columns.extend(self.products.iter().map(|own| of(own, 1)));
        }
        columns
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        (shape.variant == BESIDE).then(|| "beside the crest at mid travel too".to_owned())
    }
}
