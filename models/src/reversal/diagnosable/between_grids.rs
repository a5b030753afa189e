//! What readings of channels that are read at positions of their own differ by, though each form is one.
//!
//! A reading is carried to the centre of its cell by a smooth form. What the form is beside that between the
//! positions goes with the channel: it comes back in all of its traces, and where another channel was read
//! elsewhere it is another there. No combination of channels in which every form cancels is free of it. How
//! great it is these combinations say themselves, by what neighbouring cells of theirs differ by beyond the
//! noise of the repeats: what is smooth in them, as most errors are, has no part in that.

use nalgebra::DVector;

use super::Gathered;
use super::arrangement::Arrangement;
use super::sorting::Sorted;
use crate::model::{Column, Place};
use crate::reversal::straight_line;

/// Distance of a channel's positions from the centres of the cells, in parts of a cell, root mean square, up to
/// which the channels are read at the same places.
pub(super) const ALIKE: f64 = 0.05;
/// What the line from all centres misses, of what lines from half of them miss: of forms that the centres follow it is a
/// sixteenth (a cubic's error goes with the fourth power of the distance), of forms that they do not all.
const OF_HALVES: f64 = 0.5;

/// One trace: its channel, and for every cell how far from the centre its readings are, in parts of a cell, and
/// the value made of them.
pub(super) struct Lane {
    pub channel: usize,
    pub offsets: Vec<f64>,
    pub values: Vec<f64>,
}

/// What readings at different places leave open: the forms between the positions of the channels, and the straight
/// line that they do not have.
pub(super) fn scatter(
    sorted: &Sorted,
    arrangement: &Arrangement,
    gathered: &Gathered,
) -> Vec<Column> {
    let mut all = columns(&sorted.places, gathered.scatter);
    let (patterns, withheld) = arrangement.patterns();
    let n = sorted.positions.len();
    let middle = sorted.positions.iter().sum::<f64>() / n as f64;
    for function in withheld {
        let weights: Vec<f64> = patterns.column(function).iter().copied().collect();
        let mut profile = DVector::zeros(n);
        for (trace, channel) in sorted.traces.iter().zip(&sorted.trace_channels) {
            let values = DVector::from_column_slice(&sorted.values[trace.clone()]);
            profile.axpy(weights[*channel], &values, 1.0);
        }
        let whole: f64 = (sorted.trace_channels.iter())
            .map(|channel| weights[*channel].powi(2))
            .sum();
        profile /= whole;
        let ends = straight_line::definitional_std(&profile, &sorted.positions, gathered.ends);
        let slope = ends.hypot(missed(&profile, gathered));
        if slope > 0.0 {
            let column = line_column(&sorted.places, &weights, middle, slope);
            all.push(column);
        }
    }
    all
}

/// How far the line of a profile over all positions may be off, as its values at the cells' centres do not say what it is
/// between them, µm/mm: standard deviation, by lines from every second centre.
fn missed(profile: &DVector<f64>, gathered: &Gathered) -> f64 {
    let slope = gathered.gauge.slope.dot(profile);
    let off = gathered.halves.iter().map(|half| half.dot(profile) - slope);
    let squares: f64 = off.map(|off| off * off).sum();
    OF_HALVES * (squares / gathered.halves.len().max(1) as f64).sqrt()
}

/// Variance of what the forms differ by in a cell from channel to channel, in the unit of the readings squared;
/// zero where they are read at the same places. `closures`: weights of the channels in which no form is left.
pub(super) fn variance(lanes: &[Lane], closures: &[Vec<f64>]) -> f64 {
    let channels = closures.first().map_or(0, Vec::len);
    let of = |channel: usize| lanes.iter().filter(move |lane| lane.channel == channel);
    let apart = |channel: usize| {
        let mean = mean(of(channel).map(|lane| &lane.offsets));
        mean.norm() > ALIKE * (mean.len() as f64).sqrt()
    };
    if !(0..channels).any(apart) {
        return 0.0;
    }
    let excess = |of: fn(&[f64]) -> Vec<f64>| {
        let rows = lanes.iter().map(|lane| (lane.channel, of(&lane.values)));
        excess(&rows.collect::<Vec<_>>(), closures)
    };
    // Errors that turn from cell to cell count too much in their differences.
    excess(second_differences)
        .min(excess(without_line))
        .max(0.0)
}

/// Second differences, of the variance of the values where these are white: 1 + 4 + 1.
fn second_differences(values: &[f64]) -> Vec<f64> {
    let of = |w: &[f64]| (w[0] - 2.0 * w[1] + w[2]) / 6.0f64.sqrt();
    values.windows(3).map(of).collect()
}

/// The values less their straight line over the cells: a tilt is no form.
fn without_line(values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let from_middle = |k: usize| k as f64 - 0.5 * (n - 1.0);
    let (mut moment, mut spread) = (0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        moment += from_middle(k) * (value - mean);
        spread += from_middle(k).powi(2);
    }
    let line = |k: usize| mean + moment / spread * from_middle(k);
    values
        .iter()
        .enumerate()
        .map(|(k, v)| v - line(k))
        .collect()
}

/// Mean square of what rows of the channels' traces have in common beyond their noise, where no form is left; of
/// weights whose squares add up to one.
fn excess(rows: &[(usize, Vec<f64>)], closures: &[Vec<f64>]) -> f64 {
    let channels = closures.first().map_or(0, Vec::len);
    let of = |channel: usize| rows.iter().filter(move |own| own.0 == channel);
    let means: Vec<DVector<f64>> = (0..channels)
        .map(|channel| mean(of(channel).map(|own| &own.1)))
        .collect();
    // The noise of a trace, pooled over the channels.
    let (mut squares, mut free) = (0.0, 0.0);
    for (channel, values) in rows {
        let left = DVector::from_column_slice(values) - &means[*channel];
        squares += left.norm_squared();
    }
    for (channel, mean) in means.iter().enumerate() {
        free += (of(channel).count() as f64 - 1.0) * mean.len() as f64;
    }
    if free < 1.0 {
        return 0.0;
    }
    let noise = squares / free;
    let mut excess = 0.0;
    for closure in closures {
        let mut sum = DVector::zeros(means[0].len());
        let (mut expected, mut whole) = (0.0, 0.0);
        for (channel, weight) in closure.iter().enumerate() {
            sum.axpy(*weight, &means[channel], 1.0);
            expected += weight * weight * noise / of(channel).count() as f64;
            whole += weight * weight;
        }
        excess += (sum.norm_squared() / sum.len() as f64 - expected) / whole;
    }
    excess / closures.len() as f64
}

/// The change of all readings by one standard deviation of such a line; `weights`: of the channels.
fn line_column(places: &[Place], weights: &[f64], middle: f64, slope: f64) -> Column {
    Column::from_places(places, |_, place| {
        slope * weights[place.channel] * (place.x - middle)
    })
}

/// The change of the readings by one standard deviation in each cell of each channel.
fn columns(places: &[Place], variance: f64) -> Vec<Column> {
    if variance <= 0.0 {
        return Vec::new();
    }
    let cells = places.iter().map(|place| place.cell + 1).max().unwrap_or(0);
    let mut columns = vec![
        Column {
            rows: Vec::new(),
            values: Vec::new(),
        };
        cells
    ];
    for (row, place) in places.iter().enumerate() {
        columns[place.cell].rows.push(row);
        columns[place.cell].values.push(variance.sqrt());
    }
    columns
}

/// The mean of rows of equal lengths.
fn mean<'a>(rows: impl Iterator<Item = &'a Vec<f64>> + Clone) -> DVector<f64> {
    let count = rows.clone().count().max(1) as f64;
    let length = rows.clone().next().map_or(0, Vec::len);
    let mut sum = DVector::zeros(length);
    for row in rows {
        sum += DVector::from_column_slice(row);
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    /// Of 1A, 1B, 2A, 2B.
    fn closure() -> Vec<Vec<f64>> {
        vec![vec![1.0, 1.0, -1.0, -1.0]]
    }

    /// Eight traces a channel of 150 cells: a smooth error of channels, what the channels' traces share, and noise.
    fn lanes([shared, smooth]: [f64; 2], apart: f64, seed: u64) -> Vec<Lane> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = Normal::new(0.0, 1.0).unwrap();
        let mut made = Vec::new();
        for channel in 0..4 {
            let common: Vec<f64> = (0..150)
                .map(|k| {
                    let tilt = 3.0 * f64::from(k) * (channel as f64 - 0.5);
                    let smooth = tilt + smooth * (f64::from(k) / 30.0 + channel as f64).sin();
                    smooth + shared * normal.sample(&mut random)
                })
                .collect();
            for _ in 0..8 {
                made.push(Lane {
                    channel,
                    offsets: vec![apart * (channel as f64 - 1.5); 150],
                    values: (common.iter())
                        .map(|c| c + 0.5 * normal.sample(&mut random))
                        .collect(),
                });
            }
        }
        made
    }

    #[test]
    fn what_traces_of_a_channel_share_is_told_beside_noise_and_smooth_errors() {
        let found: Vec<f64> = (0..40)
            .map(|seed| variance(&lanes([0.3, 0.2], 0.2, seed), &closure()))
            .collect();
        let mean = found.iter().sum::<f64>() / 40.0;
        // Statistical: a closure of 150 second differences, each like 1.94 of its neighbours, tells a variance of
        // 0.09 + 0.5²/8 to 16 %, 40 of them to 2.5 %; four of these. The lesser of two estimates is no higher.
        assert!((mean - 0.09).abs() < 4.0 * 0.025 * 0.121, "{mean}");
        let none: Vec<f64> = (0..40)
            .map(|seed| variance(&lanes([0.0, 0.2], 0.2, seed), &closure()))
            .collect();
        // The same of none at all: 16 % of 0.5²/8, cut off at zero.
        let mean = none.iter().sum::<f64>() / 40.0;
        assert!(mean < 0.5 * 0.16 * 0.031 + 4.0 * 0.025 * 0.031, "{mean}");
    }

    /// What turns from cell to cell counts once, whatever the tilts: 0.09 in the mean over the channels' phases, of
    /// which second differences alone would make 16/6 as much.
    #[test]
    fn errors_that_turn_are_not_counted_twice() {
        let found: Vec<f64> = (0..40)
            .map(|seed| {
                let mut lanes = lanes([0.0; 2], 0.2, seed);
                for lane in &mut lanes {
                    let phase = (lane.channel as f64 + 1.0) * (seed as f64 + 0.5);
                    for (k, value) in lane.values.iter_mut().enumerate() {
                        let turn = if k % 2 == 0 { 0.3 } else { -0.3 };
                        *value += turn * 2.0f64.sqrt() * (0.14 * k as f64 + phase).sin();
                    }
                }
                variance(&lanes, &closure())
            })
            .collect();
        let mean = found.iter().sum::<f64>() / 40.0;
        // Statistical: one closure of four phases is off by 70 % or so, the mean of 40 by 11 %; four of these.
        assert!((mean / 0.09 - 1.0).abs() < 0.44, "{mean}");
    }

    #[test]
    fn channels_that_are_read_at_the_same_places_share_their_forms() {
        // Definition.
        assert_eq!(variance(&lanes([0.3, 0.2], 0.01, 1), &closure()), 0.0);
    }
}
