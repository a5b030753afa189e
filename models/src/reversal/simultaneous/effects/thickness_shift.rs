//! The probed surface lies half a thickness more off the tilted axis than the set-up says: h → h + D/2,
//! exact geometry.

use super::{Circumstances, Entry, JoinedEffect, Move, Unknown, only};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "thickness-shift",
    timed: false,
    variants: |_| only(ThicknessShift),
    refused: |setting| {
        setting.thickness_fitted.then_some((
            "the thickness is an unknown of the fit already",
            "leave it out of --with, or fit_thickness out of the set-up",
        ))
    },
};

#[derive(Debug)]
struct ThicknessShift;

impl JoinedEffect for ThicknessShift {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![Unknown::size("thickness", "mm", 500.0).between(-100.0, 500.0)]
    }

    fn moves(&self, _at: &Circumstances) -> Option<Move> {
        Some(Move::HalfThickness(0.5))
    }
}
