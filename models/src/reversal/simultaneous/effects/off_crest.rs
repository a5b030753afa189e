//! The stylus wanders off the crest of a cylindrical bar: slide and bar are askew sideways, and it loses
//! y²/2R, y = y₀ + x (θ + p ω) (arrow height of a circle; p the spindle position). What both spindle
//! positions share is form; the square of the position with the sign of the spindle position is not, nor is
//! a line that all channels see where y₀ is not zero: a cone.

use super::{Circumstances, Entry, JoinedEffect, Setting, Unknown, only, welcome};
use crate::reversal::Convention;

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "off-crest",
    timed: false,
    variants: |setting| only(OffCrest::of(setting)),
    refused: welcome,
};

#[derive(Debug)]
struct OffCrest {
    middle: f64,
    half: f64,
    /// Whether the line is an unknown: the convention `rigid` has it among its tilts.
    line: bool,
}

impl OffCrest {
    fn of(setting: &Setting) -> Self {
        Self {
            middle: 0.5 * (setting.travel.0 + setting.travel.1),
            half: 0.5 * setting.length(),
            line: setting.convention != Convention::Rigid,
        }
    }
}

impl JoinedEffect for OffCrest {
    fn unknowns(&self) -> Vec<Unknown> {
        let mut unknowns = vec![Unknown::size("loss", "um", 500.0)];
        if self.line {
            unknowns.push(Unknown::size("loss-along-line", "um", 500.0));
        }
        unknowns
    }

    fn is_on_surface(&self) -> bool {
        true
    }

    fn bump(
        &self,
        at: &Circumstances,
        u: f64,
        values: &[f64],
        by: &mut [f64],
    ) -> Option<(f64, f64)> {
        let part = (u - self.middle) / self.half;
        let sign = at.channel.spindle_sign();
        by[0] = -sign * part * part;
        let (mut height, mut slope) = (values[0] * by[0], -2.0 * sign * values[0] * part);
        if self.line {
            by[1] = part;
            height += values[1] * part;
            slope += values[1];
        }
        Some((height, slope / self.half))
    }
}
