//! Passes each way: whether the indicators were set to zero anew between them.
//!
//! A play of an indicator, or a slide that leans to its other side, parts the two passes by the same in all channels of an
//! indicator; a drift parts them by about what it adds along a pass, and an indicator that jumps parts those of one
//! indicator only. Zeros that are set anew do none of this: the passes of every indicator then lie apart by another height in
//! each of its channels, and these differences are not the same for all indicators.

use std::collections::BTreeMap;

/// Difference of the passes between an indicator's channels, in the scatter of a reading, from which on the channels differ; and
/// between the differences of two indicators.
const DIFFERENT: f64 = 1.0;
/// The same that one indicator's must reach, in the scatter and in what it drifts along a pass.
const APART: f64 = 3.0;

/// The two passes of a channel, or the means of those each way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BothWays {
    /// Which indicator reads the channel.
    pub indicator: usize,
    /// By how much the backward pass lies above the forward one, µm.
    pub above: f64,
    /// What a reading gains in the time of a pass, µm.
    pub drift: f64,
    /// Standard deviation of a reading beside height and drift, µm.
    pub scatter: f64,
}

impl BothWays {
    /// From places ξ, −1 to 1 over the travel, and by how much the backward pass lies above the forward one there, µm.
    /// Each is that of the means of as many `repeats` each way. `None` for fewer than four of them.
    pub fn of(indicator: usize, repeats: f64, differences: &[(f64, f64)]) -> Option<Self> {
        let n = differences.len() as f64;
        if differences.len() < 4 {
            return None;
        }
        let mean = |f: fn(&(f64, f64)) -> f64| differences.iter().map(f).sum::<f64>() / n;
        let (xi, above) = (mean(|d| d.0), mean(|d| d.1));
        let (mut product, mut spread) = (0.0, 0.0);
        for (x, d) in differences {
            product += (x - xi) * (d - above);
            spread += (x - xi).powi(2);
        }
        let slope = if spread > 0.0 { product / spread } else { 0.0 };
        let left = differences
            .iter()
            .map(|(x, d)| (d - above - slope * (x - xi)).powi(2));
        // A difference of single readings has the noise of two. Along a drift of a forward pass a backward one runs down again.
        Some(Self {
            indicator,
            above,
            drift: -slope,
            scatter: (repeats * left.sum::<f64>() / (2.0 * (n - 2.0))).sqrt(),
        })
    }
}

/// Whether the passes lie apart as where every zero is set anew.
pub fn are_zeroed(channels: &[BothWays]) -> bool {
    let mut indicators: BTreeMap<usize, Vec<&BothWays>> = BTreeMap::new();
    for channel in channels {
        indicators
            .entry(channel.indicator)
            .or_default()
            .push(channel);
    }
    if indicators.is_empty() || indicators.values().any(|own| own.len() < 2) {
        return false;
    }
    // How far apart an indicator's channels are, its scatter and its drift.
    let apart = |own: &Vec<&BothWays>| {
        let (low, high) = own.iter().fold((f64::MAX, f64::MIN), |(low, high), c| {
            (low.min(c.above), high.max(c.above))
        });
        let scatter = own.iter().map(|c| c.scatter).fold(0.0, f64::max);
        let drift = own.iter().map(|c| c.drift.abs()).fold(0.0, f64::max);
        (high - low, scatter, drift)
    };
    let all: Vec<(f64, f64, f64)> = indicators.values().map(apart).collect();
    let scatter = all.iter().map(|own| own.1).fold(0.0, f64::max);
    let each = all.iter().all(|own| own.0 > DIFFERENT * scatter);
    let any = all.iter().any(|own| own.0 > APART * own.1.max(own.2));
    let unlike = all.len() == 1
        || all
            .iter()
            .any(|own| (own.0 - all[0].0).abs() > DIFFERENT * scatter);
    each && any && unlike
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forty places over which the backward pass lies above the forward one by a height and a drift.
    fn channel(indicator: usize, above: f64, drift: f64) -> BothWays {
        let at = |k: u32| {
            let xi = -1.0 + f64::from(k) / 19.5;
            let scatter = if k.is_multiple_of(2) { 0.1 } else { -0.1 };
            (xi, above - drift * xi + scatter)
        };
        BothWays::of(indicator, 1.0, &(0..40).map(at).collect::<Vec<_>>()).unwrap()
    }

    fn zeroed(channels: [(usize, f64, f64); 4]) -> bool {
        let all: Vec<BothWays> = channels.iter().map(|c| channel(c.0, c.1, c.2)).collect();
        are_zeroed(&all)
    }

    #[test]
    fn heights_and_drifts_are_found() {
        let found = channel(0, 3.0, 0.7);
        // Truncation: an alternating scatter leans by 3 % of itself over forty places.
        assert!((found.above - 3.0).abs() < 1e-9, "{found:?}");
        assert!((found.drift - 0.7).abs() < 0.01, "{found:?}");
        assert!(
            (found.scatter - 0.1 / 2_f64.sqrt()).abs() < 0.003,
            "{found:?}"
        );
    }

    #[test]
    fn zeros_set_anew_are_told_from_play_jumps_and_drifts() {
        assert!(zeroed([
            (0, 4.1, 0.0),
            (1, -2.3, 0.0),
            (1, 0.8, 0.0),
            (0, -1.7, 0.0)
        ]));
        // A play of each indicator; a slide that leans over; one that does so where the indicators are turned.
        assert!(!zeroed([
            (0, 4.0, 0.0),
            (1, -2.0, 0.0),
            (1, -2.0, 0.0),
            (0, 4.0, 0.0)
        ]));
        assert!(!zeroed([
            (0, 2.0, 0.0),
            (1, -2.0, 0.0),
            (1, 2.0, 0.0),
            (0, -2.0, 0.0)
        ]));
        // One indicator jumps between the passes.
        assert!(!zeroed([
            (0, 5.0, 0.0),
            (1, 0.0, 0.0),
            (1, 0.0, 0.0),
            (0, 0.0, 0.0)
        ]));
        // Both warm up, most of it in the first position of the spindle.
        assert!(!zeroed([
            (0, 6.0, 5.0),
            (1, 3.0, 2.5),
            (1, 0.5, 0.4),
            (0, 1.0, 0.8)
        ]));
    }
}
