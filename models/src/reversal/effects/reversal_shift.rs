//! The artefact moves along its axis when the spindle turns.
//!
//! Of two positions of the spindle the second is shifted against the first; of more each against the
//! first, or one of them against all others. Free: the shifts.

use std::borrow::Cow;

use super::Linearised;
use crate::model::{About, Column, Effect, Link, Parameter, Shape};
use crate::reversal::designs::angle_name;
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file. Variants: every position but the first, or the second of two; then one
/// alone, from the first on.
pub(super) struct ReversalShift {
    positions: Vec<f64>,
}

/// Variant of shifts of every position but the first.
const EVERY: usize = 0;

impl ReversalShift {
    pub fn new(channels: &Arrangement) -> Self {
        Self {
            positions: channels.positions().to_vec(),
        }
    }

    /// The positions that are shifted.
    fn shifted(&self, variant: usize) -> std::ops::Range<usize> {
        match variant {
            EVERY => 1..self.positions.len().max(2),
            one => one - 1..one,
        }
    }

    fn start(&self, variant: usize) -> Shape {
        Shape {
            variant,
            values: Vec::new(),
            steps: Vec::new(),
        }
    }
}

impl Effect<Linearised> for ReversalShift {
    fn name(&self) -> &str {
        "reversal-shift"
    }

    fn about(&self) -> About {
        About {
            physics: "the artefact sits at another axial position after the spindle has turned, so its form returns shifted",
            confirm: "touch the end face of the artefact with an indicator in all spindle positions",
            source: "first-order Taylor expansion of S(x - shift) in a spindle position",
        }
    }

    fn link(&self) -> Link {
        Link::Stylus
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let shift = Parameter::symmetric("shift", "mm", 20.0);
        let own = self.shifted(shape.variant);
        if own.len() == 1 {
            return vec![shift];
        }
        let named = |p: usize| Parameter {
            name: Cow::Owned(format!("shift-at-{}deg", angle_name(self.positions[p]))),
            ..shift.clone()
        };
        own.map(named).collect()
    }

    fn grid(&self, _model: &Linearised) -> Vec<Shape> {
        match self.positions.len() {
            0..=2 => vec![self.start(EVERY)],
            count => (0..=count).map(|v| self.start(v)).collect(),
        }
    }

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let mut others = self.grid(model);
        others.retain(|other| other.variant != shape.variant);
        others
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let of = |(k, position): (usize, usize)| {
            let shift = shape.values.get(k).copied().unwrap_or(0.0);
            model.of_cell(|_, place| {
                if model.seat(place).position == position {
                    -model.side_chord(place, -shift)
                } else {
                    0.0
                }
            })
        };
        self.shifted(shape.variant).enumerate().map(of).collect()
    }

    fn open(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let own = self.shifted(shape.variant);
        model.between_positions(|_, place| {
            let position = model.seat(place).position;
            let shift = own.clone().position(|p| p == position);
            [
                0.0,
                shift
                    .and_then(|k| shape.values.get(k))
                    .map_or(0.0, |shift| -shift),
            ]
        })
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        Some(Shape {
            values: amplitudes.to_vec(),
            steps: vec![0.0; amplitudes.len()],
            ..shape.clone()
        })
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        match (self.positions.len(), shape.variant) {
            (0..=2, _) => None,
            (_, EVERY) => Some("each position against the first".to_owned()),
            (_, one) => Some(format!(
                "spindle at {}°",
                angle_name(self.positions[one - 1])
            )),
        }
    }
}
