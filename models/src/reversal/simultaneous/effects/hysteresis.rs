//! The indicator lags behind its stylus by a play: the pointer stands still until the stylus has taken the
//! play up, then follows half the width behind (play operator; Brokate and Sprekels, Hysteresis and Phase
//! Transitions, section 2.2; ISO 463). Where the pointer stands when a trace begins hangs on what came before:
//! a place within the play, −1 to 1, for the forward and the backward traces of every channel.

use std::borrow::Cow;

use super::{Entry, JoinedEffect, Kind, Play, Setting, Unknown, only, welcome};
use crate::reversal::Channel;

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "hysteresis",
    timed: false,
    variants: |setting| only(Hysteresis::of(setting)),
    refused: welcome,
};

#[derive(Debug)]
struct Hysteresis {
    /// Channel and whether backward, for every unknown beginning.
    beginnings: Vec<(Channel, bool)>,
    span: f64,
}

impl Hysteresis {
    fn of(setting: &Setting) -> Self {
        let directions: &[bool] = if setting.both_directions {
            &[false, true]
        } else {
            &[false]
        };
        let channels = setting.channels.iter();
        Self {
            beginnings: channels
                .flat_map(|c| directions.iter().map(|d| (*c, *d)))
                .collect(),
            span: setting.spans.1,
        }
    }
}

impl JoinedEffect for Hysteresis {
    fn unknowns(&self) -> Vec<Unknown> {
        let beginning = |(channel, backward): &(Channel, bool)| Unknown {
            name: Cow::Owned(format!(
                "start-{}-{}",
                channel.name(),
                if *backward { "backward" } else { "forward" }
            )),
            unit: "1",
            kind: Kind::Shape,
            low: -1.0,
            high: 1.0,
        };
        std::iter::once(Unknown::size("width", "um", 50.0).between(0.0, 50.0))
            .chain(self.beginnings.iter().map(beginning))
            .collect()
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [1e-3, 3e-3, 1e-2, 3e-2, 1e-1]
            .iter()
            .map(|part| {
                let mut values = vec![0.0; 1 + self.beginnings.len()];
                values[0] = part * self.span;
                values
            })
            .collect()
    }

    fn play(&self, channel: Channel, backward: bool) -> Option<Play> {
        let all = self.beginnings.iter();
        // Readings of one direction only count as forward.
        let own = (channel, backward && self.beginnings.iter().any(|b| b.1));
        let k = all.clone().position(|b| *b == own)?;
        Some(Play {
            width: 0,
            begins: 1 + k,
        })
    }
}
