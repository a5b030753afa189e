//! Near and far indicator have different gains: I → I + i g/2 (I − I₀), I₀ the mean reading of the channel,
//! so that the offsets keep their place.

use super::{Circumstances, Entry, JoinedEffect, Setting, Shows, Unknown, only, welcome};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "gain-mismatch",
    timed: false,
    variants: |setting| only(GainMismatch::of(setting)),
    refused: welcome,
};

/// Greatest difference: what a lever that stands at 40° to its surface in place of along it loses by the cosine. Where
/// readings are nearly straight a greater one is what a cone is too.
const GREATEST: f64 = 0.234;

#[derive(Debug)]
struct GainMismatch {
    middle: [f64; 4],
}

impl GainMismatch {
    fn of(setting: &Setting) -> Self {
        Self {
            middle: setting.middle,
        }
    }
}

impl JoinedEffect for GainMismatch {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![Unknown::size("mismatch", "1", GREATEST)]
    }

    fn shows(&self) -> Option<Shows> {
        Some(Shows::Characteristic)
    }

    fn shown(&self, at: &Circumstances, seen: f64, values: &[f64], by: &mut [f64]) -> (f64, f64) {
        let half = 0.5 * at.channel.indicator_sign();
        by[0] = half * (seen - self.middle[at.channel.index()]);
        (values[0] * by[0], values[0] * half)
    }
}
