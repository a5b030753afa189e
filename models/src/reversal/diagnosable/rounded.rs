//! What rounding leaves in the means of repeats, which no repeats show: it is no gap.
//!
//! Waves along the reading ([`rounding`](crate::reversal::rounding)), and what is not in the greatest of them as independent from
//! place to place.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use super::Linearised;
use super::sorting::Sorted;
use crate::model::Column;
use crate::reversal::designs::DesignReading;
use crate::reversal::rounding::{Rounding, pooled, scatter_within, step_of};

/// Up to so many readings in each that is diagnosed it is one.
const ONE: f64 = 1.5;

/// A channel whose repeats are off by the same for their rounding: its place among those that were read.
pub(super) type OfChannel = (usize, Rounding);

/// The steps of the channels' readings, by channel.
pub(super) fn steps(readings: &[DesignReading], channels: usize) -> Vec<Option<f64>> {
    (0..channels)
        .map(|channel| {
            let own = readings.iter().filter(|r| r.channel == channel);
            step_of(own.map(|r| r.value))
        })
        .collect()
}

/// By how much repeats of a channel scatter beside their heights, µm²: those in one direction, or both passes where nothing else
/// is repeated. `None` where nothing is.
fn scatter_of_repeats(sorted: &Sorted, channel: usize) -> Option<f64> {
    let mut directions: BTreeMap<bool, Vec<Vec<f64>>> = BTreeMap::new();
    for (trace, own) in sorted.traces.iter().zip(&sorted.trace_channels) {
        if *own == channel {
            let back = sorted.places[trace.start].direction < 0.0;
            let values = sorted.values[trace.clone()].to_vec();
            directions.entry(back).or_default().push(values);
        }
    }
    let mut groups: Vec<Vec<Vec<f64>>> = directions.into_values().collect();
    if groups.iter().all(|traces| traces.len() < 2) {
        groups = vec![groups.concat()];
    }
    pooled(groups.iter().map(|traces| scatter_within(traces)))
}

/// The channels of which repeats are off by the same for their rounding; `steps`: by channel, µm; `in_each`: readings in each value.
pub(super) fn found(sorted: &Sorted, steps: &[Option<f64>], in_each: f64) -> Vec<OfChannel> {
    let of = |(channel, step): (usize, &Option<f64>)| {
        let within = in_each * scatter_of_repeats(sorted, channel)?;
        Some((channel, Rounding::of((*step)?, within)?))
    };
    steps.iter().enumerate().filter_map(of).collect()
}

impl Linearised {
    /// What rounding leaves in the means of repeats: the change of all readings by one standard deviation of each independent cause;
    /// `levels`: by how much the readings of each trace lie above those of the fit, µm.
    pub(super) fn scatter_of_rounding(
        &self,
        rounding: &[OfChannel],
        levels: &[f64],
    ) -> Vec<Column> {
        let traces = self.record.traces.iter().zip(&self.trace_channels);
        let level_of: Vec<f64> = (traces.clone().zip(levels))
            .flat_map(|((trace, _), level)| trace.clone().map(move |_| *level))
            .collect();
        let in_each = self.gathered.as_ref().map_or(1.0, |g| g.readings_per_cell);
        let width = self.travel() / self.positions.len() as f64;
        let mut columns = Vec::new();
        for (channel, own) in rounding {
            let (waves, rest) = own.waves();
            for wave in &waves {
                for phase in [0.0, FRAC_PI_2] {
                    let error = |reading: usize| {
                        let place = &self.record.places[reading];
                        let slope = self.reading_slope(place);
                        let off = self.taken_at(reading) - place.x;
                        let y = self.cell_reading(reading) + level_of[reading] + slope * off;
                        // The mean over readings that are spread over a cell.
                        let half = 0.5 * wave.per_um * slope * width;
                        let of_mean = if in_each > ONE && half != 0.0 {
                            half.sin() / half
                        } else {
                            1.0
                        };
                        wave.std * of_mean * (wave.per_um * y + phase).cos()
                    };
                    columns.push(Column::from_places(&self.record.places, |k, place| {
                        if place.channel == *channel {
                            error(k)
                        } else {
                            0.0
                        }
                    }));
                }
            }
            let rest = (rest / in_each).sqrt();
            let mut of_places: BTreeMap<usize, Column> = BTreeMap::new();
            for (k, place) in self.record.places.iter().enumerate() {
                if place.channel == *channel {
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
