//! The artefact sits at another place along its axis in the second spindle position: S(u) → S(u − s).

use super::{Circumstances, Entry, JoinedEffect, Move, Unknown, only, welcome};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "reversal-shift",
    timed: false,
    variants: |_| only(ReversalShift),
    refused: welcome,
};

#[derive(Debug)]
struct ReversalShift;

impl JoinedEffect for ReversalShift {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![Unknown::size("shift", "mm", 20.0)]
    }

    fn moves(&self, at: &Circumstances) -> Option<Move> {
        (at.channel.spindle_sign() < 0.0).then_some(Move::Axial(1.0))
    }
}
