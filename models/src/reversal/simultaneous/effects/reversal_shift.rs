//! The artefact sits at another place along its axis in the second spindle position: S(u) → S(u − s).

use super::{Circumstances, Entry, JoinedEffect, Move, Unknown, only, welcome};

/// The fit finds a shift from a start that is no farther from it than the forms' detail is wide: starts in mm, of both
/// signs.
const STARTS: [f64; 9] = [1.0, 2.0, 3.0, 4.5, 6.0, 8.0, 10.5, 13.5, 17.0];

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

    fn starts(&self) -> Vec<Vec<f64>> {
        let apart = STARTS.iter().flat_map(|shift| [vec![*shift], vec![-shift]]);
        std::iter::once(vec![0.0]).chain(apart).collect()
    }

    fn moves(&self, at: &Circumstances) -> Option<Move> {
        (at.channel.spindle_sign() < 0.0).then_some(Move::Axial(1.0))
    }
}
