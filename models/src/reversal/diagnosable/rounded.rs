//! Readings that were rounded more coarsely than they scatter.
//!
//! Rounding to whole steps q adds a sawtooth of period q to a reading. Noise of standard deviation σ smooths it: the mean of many
//! repeats is off by a wave for each k = 1, 2, … along the reading y, of period q/k and amplitude
//!
//! A_k = q/(π k) exp(−2 π² k² σ²/q²),
//!
//! of variance s = Σ A_k²/2 over all y, and repeats scatter by σ² + q²/12 − s only (q²/12 is the variance of rounding, GUM F.2.2.1;
//! the sawtooth is of mean zero and, over all y, not correlated with the noise before it). So repeats do not show it, and it is no
//! gap. Where in its step a channel stands goes with its offset, which is free: each wave has a phase that is not known, a sine and
//! a cosine of variance A_k²/2 each. What waves beyond the [`MOST`] hold is taken as independent from place to place.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::Linearised;
use super::sorting::Sorted;
use crate::model::Column;
use crate::reversal::designs::DesignReading;

/// Waves that are told apart by their phase, at most.
const MOST: usize = 4;
/// Waves of this share of the variance are left.
const SLIGHT: f64 = 0.02;
/// Waves of which the variance is made; the rest is less than a thousandth of it.
const WAVES: usize = 600;
/// Rounding of the readings themselves, in the greatest of them.
const EXACT: f64 = 1e-9;
/// Steps finer than this, in the greatest reading, are not looked for.
const FINEST: f64 = 1e-6;

/// The step that a channel's readings are rounded to, and their noise before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// Channel, by its place among those that were read.
    pub channel: usize,
    /// µm.
    pub step: f64,
    /// Standard deviation, µm.
    noise: f64,
}

impl Rounding {
    /// From how much repeats scatter, µm²; `None` where their scatter leaves nothing of the rounding in their mean.
    fn of(channel: usize, step: f64, within: f64) -> Option<Self> {
        let (mut low, mut high) = (0.0, within.max(0.0).sqrt());
        let at = |noise: f64| Self {
            channel,
            step,
            noise,
        };
        // Halving to rounding.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let scatter = middle * middle + step * step / 12.0 - at(middle).shared();
            if scatter < within {
                low = middle;
            } else {
                high = middle;
            }
        }
        let found = at(low);
        (found.shared() > 1e-3 * within).then_some(found)
    }

    /// Variance of the wave k, µm².
    fn variance(&self, k: usize) -> f64 {
        let k = k as f64;
        let amplitude =
            self.step / (PI * k) * (-2.0 * (PI * k * self.noise / self.step).powi(2)).exp();
        0.5 * amplitude * amplitude
    }

    /// Variance of what repeats have in common, µm².
    fn shared(&self) -> f64 {
        (1..=WAVES).map(|k| self.variance(k)).sum()
    }

    /// Standard deviation of what repeats have in common, µm.
    pub fn std(&self) -> f64 {
        self.shared().sqrt()
    }
}

/// The step of which all values are whole multiples, beside what they have in common. `None` where they are all equal, or nothing
/// but what they were computed to.
fn step_of(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let greatest = values.clone().map(f64::abs).fold(0.0, f64::max);
    let first = values.clone().next()?;
    let mut step = 0.0;
    for value in values {
        // Euclid's algorithm.
        let mut rest = (value - first).abs();
        while rest > EXACT * greatest {
            (step, rest) = (rest, step % rest);
            // A remainder of almost the whole is none.
            if step - rest <= EXACT * greatest {
                rest = 0.0;
            }
        }
        if step > 0.0 && step < FINEST * greatest {
            return None;
        }
    }
    (step > 0.0).then_some(step)
}

/// The steps of the channels' readings, by channel.
pub(super) fn steps(readings: &[DesignReading], channels: usize) -> Vec<Option<f64>> {
    (0..channels)
        .map(|channel| {
            let own = readings.iter().filter(|r| r.channel == channel);
            step_of(own.map(|r| r.value))
        })
        .collect()
}

/// By how much repeats of a channel in one direction scatter, beside their heights, µm²; `None` where nothing is repeated.
fn scatter_of_repeats(sorted: &Sorted, channel: usize) -> Option<f64> {
    let mut groups: BTreeMap<bool, Vec<Vec<f64>>> = BTreeMap::new();
    for (trace, own) in sorted.traces.iter().zip(&sorted.trace_channels) {
        if *own == channel {
            let values = &sorted.values[trace.clone()];
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let level = values.iter().map(|v| v - mean).collect();
            let back = sorted.places[trace.start].direction < 0.0;
            groups.entry(back).or_default().push(level);
        }
    }
    let (mut squares, mut freedom) = (0.0, 0.0);
    for traces in groups.values() {
        let n = traces[0].len();
        for k in 0..n {
            let mean = traces.iter().map(|t| t[k]).sum::<f64>() / traces.len() as f64;
            squares += traces.iter().map(|t| (t[k] - mean).powi(2)).sum::<f64>();
        }
        freedom += (traces.len() - 1) as f64 * (n as f64 - 1.0);
    }
    (freedom > 0.0).then(|| squares / freedom)
}

/// The channels of which repeats are off by the same for their rounding; `steps`: by channel, µm; `in_each`: readings in each value.
pub(super) fn found(sorted: &Sorted, steps: &[Option<f64>], in_each: f64) -> Vec<Rounding> {
    let of = |(channel, step): (usize, &Option<f64>)| {
        let within = in_each * scatter_of_repeats(sorted, channel)?;
        Rounding::of(channel, (*step)?, within)
    };
    steps.iter().enumerate().filter_map(of).collect()
}

impl Linearised {
    /// What rounding leaves in the means of repeats: the change of all readings by one standard deviation of each independent cause;
    /// `levels`: by how much the readings of each trace lie above those of the fit, µm.
    pub(super) fn scatter_of_rounding(&self, rounding: &[Rounding], levels: &[f64]) -> Vec<Column> {
        let traces = self.record.traces.iter().zip(&self.trace_channels);
        let level_of: Vec<f64> = (traces.clone().zip(levels))
            .flat_map(|((trace, _), level)| trace.clone().map(move |_| *level))
            .collect();
        let in_each = self.gathered.as_ref().map_or(1.0, |g| g.readings_per_cell);
        let width = self.travel() / self.positions.len() as f64;
        let mut columns = Vec::new();
        for own in rounding {
            let whole = own.shared();
            let mut told = 0.0;
            for k in 1..=MOST {
                let variance = own.variance(k);
                if variance < SLIGHT * whole {
                    break;
                }
                told += variance;
                let turns = 2.0 * PI * k as f64 / own.step;
                for phase in [0.0, 0.5 * PI] {
                    let wave = |reading: usize| {
                        let place = &self.record.places[reading];
                        let slope = self.reading_slope(place);
                        let off = self.taken_at(reading) - place.x;
                        let y = self.cell_reading(reading) + level_of[reading] + slope * off;
                        // The mean over readings that are spread over a cell.
                        let half = 0.5 * turns * slope * width;
                        let of_mean = if in_each > 1.5 && half != 0.0 {
                            half.sin() / half
                        } else {
                            1.0
                        };
                        variance.sqrt() * of_mean * (turns * y + phase).cos()
                    };
                    columns.push(Column::from_places(&self.record.places, |k, place| {
                        if place.channel == own.channel {
                            wave(k)
                        } else {
                            0.0
                        }
                    }));
                }
            }
            let rest = ((whole - told).max(0.0) / in_each).sqrt();
            let mut of_places: BTreeMap<usize, Column> = BTreeMap::new();
            for (k, place) in self.record.places.iter().enumerate() {
                if place.channel == own.channel {
                    let column = of_places.entry(place.cell).or_default();
                    column.rows.push(k);
                    column.values.push(rest);
                }
            }
            if rest > 0.0 {
                columns.extend(of_places.into_values());
            }
        }
        columns
    }
}
