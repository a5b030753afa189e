//! The noise of each channel as neighbouring readings tell it: free of whatever a model misses that is
//! smooth along a trace, or that every repeat has.
//!
//! Every reading is taken against the line through its neighbours in the same trace; where there are
//! repeats, the same is done with contrasts of the repeats. Differences beyond three standard deviations
//! (told by the median first) are left out where channels are told apart, so that neither an outlier nor a
//! jump makes a channel's noise.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::traces::{Group, Trace};

/// Most differences of a trace that are looked at, evenly spread.
const MOST: usize = 4096;
/// Differences beyond so many standard deviations are left out.
const CUT: f64 = 3.0;
/// The mean of z² of what is kept of standard normal z, and the degrees of freedom of that mean a
/// difference; both drawn, neighbouring differences overlapping.
const CUT_MEAN: f64 = 0.970;
const SHARE: f64 = 0.47;
/// Noise that differs between channels is believed below this probability that equal noise would
/// differ so (Bartlett's test).
const LEVEL: f64 = 0.01;
/// Least information on the logarithm of a channel's variance with which channels are told apart.
const LEAST_INFORMATION: f64 = 5.0;
/// No channel's noise is taken below this share of the noisiest: readings without any would
/// otherwise be the only ones to count.
const LEAST: f64 = 1e-3;

/// What the differences of one channel say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Variance of one reading, outliers left out.
    pub variance: f64,
    /// The same with all in it.
    pub whole: f64,
    /// Degrees of freedom of these.
    pub freedom: f64,
}

/// The levels of all channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Levels(pub Vec<Level>);

impl Levels {
    /// From positions and values (readings or residuals) of each channel's sorted readings, trace by trace.
    pub fn along(x: &[&[f64]], traces: &[Vec<Trace>], values: &[&[f64]]) -> Self {
        let levels = x.iter().zip(traces).zip(values);
        Self(
            levels
                .map(|((x, traces), values)| {
                    let mut found = Vec::new();
                    for trace in traces {
                        let x = |k: usize| x[trace.row(k)];
                        let y = |k: usize| values[trace.row(k)];
                        differences(trace.len(), x, y, &mut found);
                    }
                    level(found)
                })
                .collect(),
        )
    }

    /// From contrasts of the repeats of residuals; channels without repeats have no freedom.
    pub fn of_repeats(
        channels: usize,
        groups: &[Group],
        means: impl Fn(&Group) -> Vec<Vec<f64>>,
    ) -> Self {
        let mut found = vec![Vec::new(); channels];
        for group in groups.iter().filter(|g| g.traces.len() > 1) {
            let repeats = means(group);
            let count = repeats.len() as f64;
            let complete = group.complete();
            let x = |k: usize| group.positions[complete[k]];
            let middle: Vec<f64> = complete
                .iter()
                .enumerate()
                .map(|(k, _)| repeats.iter().map(|r| r[k]).sum::<f64>() / count)
                .collect();
            // Deviations from the mean of the repeats: (R − 1)/R of the variance each.
            let scale = (count / (count - 1.0)).sqrt();
            for repeat in &repeats {
                let y = |k: usize| scale * (repeat[k] - middle[k]);
                differences(complete.len(), x, y, &mut found[group.channel]);
            }
        }
        let share = groups.iter().map(|g| g.traces.len()).max().unwrap_or(1) as f64;
        let mut levels: Vec<Level> = found.into_iter().map(level).collect();
        for level in &mut levels {
            level.freedom *= (share - 1.0) / share;
        }
        Self(levels)
    }

    /// The variance of all channels together, and its degrees of freedom.
    pub fn pooled(&self) -> Level {
        let freedom: f64 = self.0.iter().map(|l| l.freedom).sum();
        let mean = |of: fn(&Level) -> f64| {
            let sum: f64 = self.0.iter().map(|l| l.freedom * of(l)).sum();
            if freedom > 0.0 { sum / freedom } else { 0.0 }
        };
        Level {
            variance: mean(|l| l.variance),
            whole: mean(|l| l.whole),
            freedom,
        }
    }

    /// The standard deviation of each channel: its own where the channels differ beyond chance and each
    /// is known well enough, otherwise that of all. `kept` is the share of each channel's readings
    /// that tells of its own noise.
    pub fn sigmas(&self, kept: &[f64]) -> Vec<f64> {
        let known = self
            .0
            .iter()
            .zip(kept)
            .all(|(l, kept)| 0.5 * l.freedom * kept >= LEAST_INFORMATION);
        if known && self.differ() {
            return self.own();
        }
        let pooled = self.pooled().variance.sqrt();
        let sigma = if pooled > 0.0 { pooled } else { 1.0 };
        vec![sigma; self.0.len()]
    }

    /// Each channel's own, however little is known.
    fn own(&self) -> Vec<f64> {
        let most = self.0.iter().fold(0.0_f64, |m, l| m.max(l.variance)).sqrt();
        self.0
            .iter()
            .map(|l| l.variance.sqrt().max(LEAST * most))
            .collect()
    }

    /// Whether the channels' variances differ beyond chance (Bartlett 1937).
    pub fn differ(&self) -> bool {
        let pooled = self.pooled();
        if self.0.len() < 2 || !(pooled.variance > 0.0) {
            return false;
        }
        let own = self.own();
        let statistic: f64 = self
            .0
            .iter()
            .zip(own)
            .map(|(l, own)| l.freedom * (pooled.variance / (own * own)).ln())
            .sum();
        let more = self.0.len() as f64 - 1.0;
        let inverse: f64 = self.0.iter().map(|l| 1.0 / l.freedom).sum();
        let correction = 1.0 + (inverse - 1.0 / pooled.freedom) / (3.0 * more);
        ChiSquared::new(more).is_ok_and(|law| law.sf(statistic / correction) < LEVEL)
    }
}

/// Each value against the line through its neighbours, in units that make its standard deviation that
/// of one value.
fn differences(
    count: usize,
    x: impl Fn(usize) -> f64,
    y: impl Fn(usize) -> f64,
    found: &mut Vec<f64>,
) {
    let inner = count.saturating_sub(2);
    found.reserve(inner.min(MOST));
    for i in (0..inner).step_by(inner.div_ceil(MOST).max(1)) {
        let (left, middle, right) = (x(i), x(i + 1), x(i + 2));
        let share = if right > left {
            (middle - left) / (right - left)
        } else {
            0.5
        };
        let rest = y(i + 1) - (1.0 - share) * y(i) - share * y(i + 2);
        found.push(rest / (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt());
    }
}

fn level(mut found: Vec<f64>) -> Level {
    let count = found.len() as f64;
    for d in &mut found {
        *d *= *d;
    }
    let whole = found.iter().sum::<f64>() / count.max(1.0);
    let middle = found.len() / 2;
    let median = if found.is_empty() {
        0.0
    } else {
        *found.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    // The median of z² of a standard normal z is 0.4549. Readings of which half are equal tell
    // nothing by it.
    let most = CUT * CUT * median / 0.4549;
    let (sum, kept) = found
        .iter()
        .filter(|d| **d <= most)
        .fold((0.0, 0.0), |(sum, kept), d| (sum + d, kept + 1.0));
    Level {
        variance: if median > 0.0 {
            sum / kept / CUT_MEAN
        } else {
            whole
        },
        whole,
        freedom: SHARE * count,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reversal::simultaneous::ChannelReadings;
    use crate::reversal::{Channel, Observations, Reading};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn levels(n: usize, sigmas: [f64; 4], form: impl Fn(f64) -> f64, seed: u64) -> Levels {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut data = Observations::default();
        for (channel, sigma) in Channel::ALL.into_iter().zip(sigmas) {
            for k in 0..n {
                let z: f64 = StandardNormal.sample(&mut random);
                data.readings.push(Reading {
                    channel,
                    repeat: 1,
                    direction: crate::reversal::Direction::Forward,
                    time: None,
                    x: 2.0 * k as f64,
                    value: form(2.0 * k as f64) + sigma * z,
                });
            }
        }
        let channels = ChannelReadings::sort(&data);
        let x: Vec<&[f64]> = channels.iter().map(|c| c.x.as_slice()).collect();
        let traces = super::super::traces::of(&channels, |i| {
            (data.readings[i].direction, data.readings[i].repeat)
        });
        let values: Vec<&[f64]> = channels.iter().map(|c| c.value.as_slice()).collect();
        Levels::along(&x, &traces, &values)
    }

    /// Channels of equal noise are told apart as rarely as the level says, and their variance with the
    /// degrees of freedom that are claimed.
    #[test]
    fn equal_noise_stays_equal() {
        let (mut apart, mut sum, mut square, mut freedom) = (0, 0.0, 0.0, 0.0);
        let seeds = 600;
        for seed in 0..seeds {
            let levels = levels(60, [0.5; 4], |x| 1e-3 * x * x, seed);
            apart += u32::from(levels.differ());
            let pooled = levels.pooled();
            let v = pooled.variance / 0.25;
            sum += v;
            square += v * v;
            freedom = pooled.freedom;
        }
        let count = seeds as f64;
        let (mean, variance) = (sum / count, square / count - (sum / count).powi(2));
        // k·u: 6 of 600 expected, 2.4 their standard deviation; four of them.
        assert!(apart <= 16, "{apart}");
        // The form's own bend brings 1e-3·4, of 0.5 √1.5 the hundredth part; k·u for the rest.
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
        // k·u: the variance of 600 values is known to 6 %; the share of information is one figure for
        // all cuts.
        assert!(
            (variance * freedom / 2.0 - 1.0).abs() < 0.25,
            "{variance} {freedom}"
        );
    }

    #[test]
    fn a_noisy_channel_is_told_and_a_jump_is_not_one() {
        let noisy = levels(60, [0.05, 0.5, 0.05, 0.05], |_| 0.0, 1).sigmas(&[1.0; 4]);
        assert!(noisy[1] / noisy[0] > 6.0, "{noisy:?}");
        let jump = levels(60, [0.05; 4], |x| f64::from(u8::from(x > 50.0)), 2).sigmas(&[1.0; 4]);
        assert!(
            jump.iter().all(|s| (s / 0.05 - 1.0).abs() < 0.3),
            "{jump:?}"
        );
        // Too little is known of each.
        let few = levels(12, [0.05, 0.5, 0.05, 0.05], |_| 0.0, 1).sigmas(&[1.0; 4]);
        assert!(few.windows(2).all(|p| p[0] == p[1]), "{few:?}");
    }
}
