//! The slide runs half the lateral play to either side of its line, by direction: every channel sees it
//! with the sign of M (ISO 230-1, straightness in both directions).

use super::{Circumstances, Entry, JoinedEffect, Move, Unknown, only, welcome};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "lateral-backlash",
    timed: false,
    variants: |_| only(LateralBacklash),
    refused: welcome,
};

#[derive(Debug)]
struct LateralBacklash;

impl JoinedEffect for LateralBacklash {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![Unknown::size("backlash", "um", 100.0)]
    }

    fn moves(&self, at: &Circumstances) -> Option<Move> {
        Some(Move::Lateral(-0.5 * at.direction))
    }
}
