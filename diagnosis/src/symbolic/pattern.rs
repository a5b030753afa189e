//! Which readings a term changes, and with which sign: patterns over channels and directions.

use errsep_models::model::{AnyModel, FittedModel, Place};

/// *Limit.* Channels of which every pair and every choice of signs is a pattern.
const FEW_CHANNELS: usize = 4;

/// How a term depends on the direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turn {
    /// Not at all.
    Alike,
    /// By its sign.
    Turning,
    /// It is there forwards only.
    Forward,
    /// It is there backwards only.
    Backward,
}

/// Weights −1, 0 or 1 of each channel, and the direction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Pattern {
    pub channels: Vec<i8>,
    pub turn: Turn,
}

/// The readings of one channel and direction are a block.
pub(super) fn block_of(place: &Place) -> usize {
    2 * place.channel + usize::from(place.direction < 0.0)
}

impl Pattern {
    /// All patterns of a model, the simplest first.
    pub fn all(model: &AnyModel) -> Vec<Self> {
        let backward = model.places().iter().any(|p| p.direction < 0.0);
        let forward = model.places().iter().any(|p| p.direction >= 0.0);
        let turns: &[Turn] = if backward && forward {
            &[Turn::Alike, Turn::Turning, Turn::Forward, Turn::Backward]
        } else {
            &[Turn::Alike]
        };
        let over = over_channels(model);
        let mut all = Vec::new();
        for turn in turns {
            all.extend(over.iter().map(|channels| Self {
                channels: channels.clone(),
                turn: *turn,
            }));
        }
        all
    }

    /// Whether it tells no reading from another.
    pub fn is_plain(&self) -> bool {
        self.turn == Turn::Alike && self.channels.iter().all(|w| *w == 1)
    }

    /// Whether it is of one channel or of all alike, whatever the direction.
    pub fn is_simple(&self) -> bool {
        let alone = self.channels.iter().filter(|w| **w != 0).count() == 1;
        self.turn == Turn::Alike && (alone || !self.is_of_channels())
    }

    /// The weight of a block.
    pub fn weight(&self, block: usize) -> f64 {
        let backward = block % 2 == 1;
        let turned = match (self.turn, backward) {
            (Turn::Alike, _) | (Turn::Turning | Turn::Forward, false) | (Turn::Backward, true) => {
                1.0
            }
            (Turn::Turning, true) => -1.0,
            (Turn::Forward, true) | (Turn::Backward, false) => 0.0,
        };
        turned * f64::from(self.channels.get(block / 2).copied().unwrap_or(0))
    }

    /// Whether it has a weight other than one for some channel.
    pub fn is_of_channels(&self) -> bool {
        self.channels.iter().any(|w| *w != 1)
    }

    /// In words, without the direction where there is none: "1A − 2B".
    pub fn name(&self, channels: &[String]) -> String {
        let mut text = String::new();
        if self.is_of_channels() {
            for (weight, name) in self.channels.iter().zip(channels) {
                match weight {
                    1 if text.is_empty() => text += name,
                    1 => text += &format!(" + {name}"),
                    -1 => text += &format!(" − {name}"),
                    _ => {}
                }
            }
        } else {
            text += if channels.len() > 1 {
                "all channels"
            } else {
                "all readings"
            };
        }
        text += match self.turn {
            Turn::Alike => "",
            Turn::Turning => ", turning with the direction",
            Turn::Forward => ", forwards only",
            Turn::Backward => ", backwards only",
        };
        text
    }
}

/// Weights over the channels: all alike, one, the model's own combinations of equal weights, and of few channels
/// every pair and every choice of signs. Of two that differ by their sign only the first stands.
fn over_channels(model: &AnyModel) -> Vec<Vec<i8>> {
    let count = model.channel_names().len();
    let single = |k: usize| {
        (0..count)
            .map(move |c| i8::from(c == k))
            .collect::<Vec<i8>>()
    };
    let mut all: Vec<Vec<i8>> = vec![vec![1; count]];
    all.extend((0..count).map(single));
    for pattern in model.patterns() {
        let greatest = pattern.weights.iter().fold(0.0, |m: f64, w| m.max(w.abs()));
        let whole = pattern.weights.iter().map(|w| w / greatest);
        let whole: Option<Vec<i8>> = whole
            .map(|w| {
                [-1i8, 0, 1]
                    .into_iter()
                    .find(|k| (f64::from(*k) - w).abs() < 1e-9)
            })
            .collect();
        all.extend(whole);
    }
    if count <= FEW_CHANNELS {
        for (a, b) in (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b))) {
            for sign in [1, -1] {
                let mut pair = single(a);
                pair[b] = sign;
                all.push(pair);
            }
        }
        for signs in 0..1u32 << count.saturating_sub(1) {
            let sign = |c: usize| {
                if c > 0 && signs >> (c - 1) & 1 == 1 {
                    -1
                } else {
                    1
                }
            };
            all.push((0..count).map(sign).collect());
        }
    }
    let mut kept: Vec<Vec<i8>> = Vec::new();
    for mut weights in all {
        let first = weights.iter().find(|w| **w != 0).copied().unwrap_or(0);
        weights.iter_mut().for_each(|w| *w *= first);
        if first != 0 && !kept.contains(&weights) {
            kept.push(weights);
        }
    }
    kept
}
