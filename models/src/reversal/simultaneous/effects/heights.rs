//! The heights of repeats as unknowns beside effects: no effect of the catalogue, and nothing that is told.
//!
//! The heights of a channel add up to zero, as its offset is an unknown of its own.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{Circumstances, JoinedEffect, Shows, Unknown};
use crate::reversal::{Channel, Direction, Observations};

/// Their name among the effects.
pub const HEIGHTS: &str = "heights of the repeats";
/// As high as no repeat lies, µm.
const REACH: f64 = 1e6;

/// A channel's repeat, and whether the slide runs backward where that has a height of its own.
type Key = (Channel, u32, bool);

/// See the head of the file.
#[derive(Debug)]
pub struct Heights {
    by_pass: bool,
    /// The unknowns that make the height of a repeat, with their sign.
    made_of: BTreeMap<Key, (std::ops::Range<usize>, f64)>,
    count: usize,
}

impl Heights {
    /// Those of all repeats; `by_pass`: whether both directions of a repeat have heights of their own.
    pub fn of(observations: &Observations, by_pass: bool) -> Arc<dyn JoinedEffect> {
        let mut channels: BTreeMap<Channel, BTreeSet<(u32, bool)>> = BTreeMap::new();
        for reading in &observations.readings {
            let back = by_pass && reading.direction == Direction::Backward;
            let own = channels.entry(reading.channel).or_default();
            own.insert((reading.repeat, back));
        }
        let mut heights = Self {
            by_pass,
            made_of: BTreeMap::new(),
            count: 0,
        };
        for (channel, repeats) in channels {
            let first = heights.count;
            let last = first + repeats.len() - 1;
            for (k, (repeat, back)) in (first..).zip(repeats) {
                let made_of = if k < last {
                    (k..k + 1, 1.0)
                } else {
                    (first..last, -1.0)
                };
                heights.made_of.insert((channel, repeat, back), made_of);
            }
            heights.count = last;
        }
        Arc::new(heights)
    }
}

impl JoinedEffect for Heights {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![Unknown::size("height", "um", REACH); self.count]
    }

    fn shows(&self) -> Option<Shows> {
        Some(Shows::Height)
    }

    fn shown(&self, at: &Circumstances, _seen: f64, values: &[f64], by: &mut [f64]) -> (f64, f64) {
        let back = self.by_pass && at.direction < 0.0;
        let Some((made_of, sign)) = self.made_of.get(&(at.channel, at.repeat, back)) else {
            return (0.0, 0.0);
        };
        by[made_of.clone()].fill(*sign);
        (sign * values[made_of.clone()].iter().sum::<f64>(), 0.0)
    }
}
