//! The artefact is a cone: both surfaces fall away from its axis, and every channel sees it tilted by the
//! half angle more. Rigid-body geometry of a frustum between two indicators.

use super::{Circumstances, Entry, JoinedEffect, Move, Unknown, only};
use crate::reversal::Convention;

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "taper",
    timed: false,
    variants: |_| only(Taper),
    refused: |setting| {
        (setting.convention == Convention::Rigid).then_some((
            "the convention `rigid` has the cone among its tilts already",
            "read the cone there, or leave [model] convention out of the set-up",
        ))
    },
};

#[derive(Debug)]
struct Taper;

impl JoinedEffect for Taper {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![Unknown::size("half-angle", "rad", 0.1)]
    }

    fn moves(&self, _at: &Circumstances) -> Option<Move> {
        Some(Move::Tilt(1.0))
    }
}
