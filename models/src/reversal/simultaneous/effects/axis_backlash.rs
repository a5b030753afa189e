//! The slide stands half the lost motion behind its command, to either side: x → x ∓ B/2 (ISO 230-2,
//! reversal value).

use super::{Circumstances, Entry, JoinedEffect, Move, Unknown, only, welcome};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "axis-backlash",
    timed: false,
    variants: |_| only(AxisBacklash),
    refused: welcome,
};

#[derive(Debug)]
struct AxisBacklash;

impl JoinedEffect for AxisBacklash {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![Unknown::size("backlash", "mm", 10.0)]
    }

    fn moves(&self, at: &Circumstances) -> Option<Move> {
        Some(Move::Slide(-0.5 * at.direction))
    }
}
