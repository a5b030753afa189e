//! The spindle is not turned by exactly the angle that is told.
//!
//! A bar that is askew to the spindle axis shows a part of it towards other indicators when a position
//! is off by δ: n(ψ − δ) in place of n(ψ). With two positions half a turn apart it looks like a tilt of
//! slide and artefact, so to first order it is absorbed, and half of it goes into α. Free: the products
//! of tilt and error.

use super::Linearised;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::reversal::designs::angle_name;
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file. Variants: the positions of the spindle from the second on.
pub(super) struct IndexingError {
    positions: Vec<f64>,
    /// Whether the second position is the only other one, half a turn away.
    half_turn: bool,
    /// Directions of the tilt that some side sees.
    axes: Vec<usize>,
    four: bool,
}

impl IndexingError {
    pub fn new(channels: &Arrangement) -> Self {
        let positions = channels.positions().to_vec();
        let half_turn = match positions[..] {
            [first, second] => (second - first - 180.0).abs() < 0.5,
            _ => positions.len() < 2,
        };
        let sees = |axis: &usize| channels.seats().iter().any(|s| s.psi[*axis] != 0.0);
        Self {
            half_turn,
            axes: (0..2).filter(sees).collect(),
            positions,
            four: channels.is_four(),
        }
    }

    fn position(&self, shape: &Shape) -> usize {
        1 + shape.variant
    }
}

impl Effect<Linearised> for IndexingError {
    fn name(&self) -> &str {
        "indexing-error"
    }

    fn about(&self) -> About {
        About {
            physics: "a spindle position is not exactly at its angle from the first, so a sideways tilt of the artefact shows in it",
            confirm: "check the angles with a level or an angle encoder, and align the artefact sideways too",
            source: "rotation of the tilt vector of the artefact by the error of the angle",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        let name = |axis: &usize| match (self.axes.len(), axis) {
            (1, _) => "tilt",
            (_, 0) => "tilt-1",
            _ => "tilt-2",
        };
        let tilt = |axis: &usize| Parameter::symmetric(name(axis), "rad", 0.01);
        self.axes.iter().map(tilt).collect()
    }

    fn grid(&self, _model: &Linearised) -> Vec<Shape> {
        let others = self.positions.len().saturating_sub(1);
        (0..others.max(usize::from(self.four)))
            .map(Shape::variant)
            .collect()
    }

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let mut others = self.grid(model);
        others.retain(|other| other.variant != shape.variant);
        others
    }

    fn absorbed(&self) -> bool {
        self.half_turn
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let position = self.position(shape);
        let of = |axis: &usize| {
            Column::from_places(model.places(), |_, place| {
                let seat = model.seat(place);
                let off = f64::from(u8::from(seat.position == position));
                off * seat.psi[*axis] * place.x * 1e3
            })
        };
        self.axes.iter().map(of).collect()
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        let angle = self.positions.get(self.position(shape))?;
        (self.positions.len() > 2).then(|| format!("spindle at {}°", angle_name(*angle)))
    }
}
