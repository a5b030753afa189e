//! The taper of the artefact differs around it.
//!
//! Sides climb by κ_c cos 2ψ + κ_s sin 2ψ beside a cone and the tilt of the axis. A term of the fit
//! where the design determines it, and absorbed then; elsewhere it shows as far as slopes do not take
//! it up. Free: κ_c and κ_s, as far as sides see them.

use super::Linearised;
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file.
pub(super) struct OvalCone {
    /// Cosine, sine: those that some side sees.
    seen: Vec<usize>,
}

const NAMES: [&str; 2] = ["kappa_c", "kappa_s"];

impl OvalCone {
    pub fn new(channels: &Arrangement) -> Self {
        let sees = |axis: &usize| channels.seats().iter().any(|s| s.oval[*axis] != 0.0);
        Self {
            seen: (0..2).filter(sees).collect(),
        }
    }
}

impl Effect<Linearised> for OvalCone {
    fn name(&self) -> &str {
        "oval-cone"
    }

    fn about(&self) -> About {
        About {
            physics: "the artefact is round at one end and oval at the other, so its taper differs from side to side",
            confirm: "measure two diameters at right angles at both ends",
            source: "second harmonic around the artefact of the slopes of its sides",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Stylus
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        let of = |axis: &usize| Parameter::symmetric(NAMES[*axis], "rad", 0.1);
        self.seen.iter().map(of).collect()
    }

    fn columns(&self, model: &Linearised, _shape: &Shape) -> Vec<Column> {
        let of = |axis: &usize| {
            Column::from_places(model.places(), |_, place| {
                model.seat(place).oval[*axis] * place.x * 1e3
            })
        };
        self.seen.iter().map(of).collect()
    }
}
