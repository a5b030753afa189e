//! The indicators have different gains.
//!
//! Two: one amplitude, their difference. More: each but the first against the first, or one of them
//! against all others. A gain common to all is `common-gain`.

use super::Linearised;
use super::indicators::{ALL, Indicators};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};

/// See the head of the file. Variants: all indicators, then one alone; two indicators have but one.
pub(super) struct GainMismatch(pub Indicators);

/// Greatest difference: what a lever that stands at 40° to its surface in place of along it loses by the cosine. Where
/// readings are nearly straight a greater one is what a cone is too.
const GREATEST: f64 = 0.234;

impl Effect<Linearised> for GainMismatch {
    fn name(&self) -> &str {
        "gain-mismatch"
    }

    fn about(&self) -> About {
        About {
            physics: "one indicator reads a larger part of the same displacement than the other",
            confirm: "swap the indicators, or calibrate both against the same gauge blocks",
            source: "I (1 + i g / 2): near and far gain differ by g; I (1 + g) of one of more",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Sensor
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let mismatch = Parameter::symmetric("mismatch", "1", GREATEST);
        match (self.0.count(), shape.variant) {
            (0..=2, _) => vec![mismatch],
            (_, ALL) => self.0.sizes(ALL, &mismatch, "mismatch").split_off(1),
            (_, one) => self.0.sizes(one, &mismatch, "mismatch"),
        }
    }

    fn grid(&self, _model: &Linearised) -> Vec<Shape> {
        match self.0.count() {
            0 | 1 => Vec::new(),
            2 => vec![Shape::only()],
            _ => self.0.scopes().map(Shape::variant).collect(),
        }
    }

    fn relatives(&self, _model: &Linearised, shape: &Shape) -> Vec<Shape> {
        match self.0.count() {
            0..=2 => Vec::new(),
            _ => self.0.others(shape.variant).map(Shape::variant).collect(),
        }
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let two = self.0.count() == 2;
        let all = Column::from_places(model.places(), |k, place| {
            let share = match (two, model.seat(place).indicator) {
                (false, _) => 1.0,
                (true, 0) => 0.5,
                (true, _) => -0.5,
            };
            share * (model.smooth_reading(k) - model.mid_reading(place))
        });
        if two {
            return vec![all];
        }
        let mut own = self.0.apart(model, shape.variant, &all);
        if shape.variant == ALL {
            own.remove(0);
        }
        own
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        match (self.0.count(), shape.variant) {
            (0..=2, _) => None,
            (_, ALL) => Some(format!("each against the {} indicator", self.0.name(0))),
            (_, one) => Some(self.0.words(one)),
        }
    }
}
