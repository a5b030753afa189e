//! The slide lags behind its command by half the backlash, to either side.
//!
//! A screw that is worn at one end loses more there: the lost motion grows along the travel.
//! Free: the lost motion at mid travel, and what is added to it at the end of a worn screw.

use super::{Linearised, part_of_travel};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Place, Shape};

/// See the head of the file. Variants: the same all along, [`WORN`].
pub(super) struct AxisBacklash;

/// Variant of a lost motion that grows along the travel.
const WORN: usize = 1;

/// That variant in words.
pub(super) const GROWS: &str = "growing along the travel";

impl Effect<Linearised> for AxisBacklash {
    fn name(&self) -> &str {
        "axis-backlash"
    }

    fn about(&self) -> About {
        About {
            physics: "the slide stands half the backlash behind its command, so form and slope return shifted between forward and backward",
            confirm: "reverse the axis under a dial gauge or laser at both ends and in the middle of the travel and read the lost motion",
            source: "ISO 230-2 reversal value; I(x -/+ B/2)",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Slide
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        // A control that makes up for more than is lost turns its sign.
        let lost = Parameter::symmetric("backlash", "mm", 10.0);
        let more = Parameter::symmetric("backlash-added-at-end", "mm", 10.0);
        if shape.variant == WORN {
            vec![lost, more]
        } else {
            vec![lost]
        }
    }

    fn grid(&self, _model: &Linearised) -> Vec<Shape> {
        vec![at(0, &[0.0])]
    }

    fn relatives(&self, _model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let lost = shape.values.first().copied().unwrap_or(0.0);
        vec![if shape.variant == WORN {
            at(0, &[lost])
        } else {
            at(WORN, &[lost, 0.0])
        }]
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let lost = shape.values.first().copied().unwrap_or(0.0);
        let more = shape.values.get(1).copied().unwrap_or(0.0);
        let with = |along: &(dyn Fn(f64) -> f64 + Sync)| {
            let change = |k: usize, place: &Place| {
                let half = -0.5 * place.direction;
                let part = part_of_travel(model, place.x);
                half * along(part) * model.reading_chord(k, half * (lost + more * part))
            };
            if model.lies_beneath() {
                Column::from_places(model.places(), change)
            } else {
                model.of_cell(change)
            }
        };
        if shape.variant == WORN {
            vec![with(&|_| 1.0), with(&|part| part)]
        } else {
            vec![with(&|_| 1.0)]
        }
    }

    fn open(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let lost = shape.values.first().copied().unwrap_or(0.0);
        let more = shape.values.get(1).copied().unwrap_or(0.0);
        model.between_positions(|_, place| {
            let part = part_of_travel(model, place.x);
            [-0.5 * place.direction * (lost + more * part); 2]
        })
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        (shape.values.len() == amplitudes.len()).then(|| at(shape.variant, amplitudes))
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        (shape.variant == WORN).then(|| GROWS.to_owned())
    }
}

/// A variant at the sizes that were found: they are not searched.
fn at(variant: usize, sizes: &[f64]) -> Shape {
    Shape {
        variant,
        values: sizes.to_vec(),
        steps: vec![0.0; sizes.len()],
    }
}
