//! Heights of repeats that are unknowns of the fit ([`are_free`]).

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::arrangement::Seat;
use super::sorting::{Sorted, TraceKey, trace_key};
use crate::model::Place;
use crate::reversal::channel_noise::heights::{Course, Height, Repeats, are_free};
use crate::reversal::channel_noise::passes::{BothWays, are_zeroed};
use crate::reversal::designs::DesignObservations;

/// The heights of a model.
#[derive(Debug, Clone)]
pub(super) struct Heights {
    /// By trace, which of them it has.
    of_trace: Vec<usize>,
    count: usize,
}

impl Heights {
    /// The heights of readings, where they are to be free.
    pub fn of(sorted: &Sorted, seats: &[Seat]) -> Option<Self> {
        let by_pass = match are_zeroed(&both_ways(sorted, seats)) {
            true => true,
            false => are_free(&repeated(sorted), &courses(sorted, seats))?,
        };
        Some(Self::free(&sorted.places, &sorted.traces, by_pass))
    }

    /// Free heights of these traces: one for every trace, or one for both directions of a repeat.
    pub fn free(places: &[Place], traces: &[Range<usize>], by_pass: bool) -> Self {
        let mut known = BTreeMap::new();
        let of_trace = traces.iter().map(|trace| {
            let first = &places[trace.start];
            let back = by_pass && first.direction < 0.0;
            let next = known.len();
            *known
                .entry((first.channel, first.repeat, back))
                .or_insert(next)
        });
        let of_trace = of_trace.collect();
        Self {
            of_trace,
            count: known.len(),
        }
    }

    /// Whether both directions of a repeat have heights of their own.
    pub fn by_pass(&self) -> bool {
        self.count == self.of_trace.len()
    }

    /// How the heights enter, readings × heights.
    pub fn columns(&self, traces: &[Range<usize>]) -> DMatrix<f64> {
        let readings = traces.iter().map(|t| t.end).max().unwrap_or(0);
        let mut columns = DMatrix::zeros(readings, self.count);
        for (trace, height) in traces.iter().zip(&self.of_trace) {
            columns
                .column_mut(*height)
                .rows_mut(trace.start, trace.len())
                .fill(1.0);
        }
        columns
    }

    /// How far every trace lies above the mean of its channel, by its height, µm.
    pub fn above(
        &self,
        observed: &DVector<f64>,
        traces: &[Range<usize>],
        channels: &[usize],
    ) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.count];
        let mut of_channel: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        let all = || traces.iter().zip(&self.of_trace).zip(channels);
        for ((trace, height), channel) in all() {
            let sum = observed.rows(trace.start, trace.len()).sum();
            for to in [&mut sums[*height], of_channel.entry(*channel).or_default()] {
                *to = (to.0 + sum, to.1 + trace.len() as f64);
            }
        }
        let above = all().map(|((_, height), channel)| {
            let (own, all) = (sums[*height], of_channel[channel]);
            own.0 / own.1 - all.0 / all.1
        });
        above.collect()
    }

    /// Readings of a file without the heights that their traces show where they have been sorted, and the greatest, µm.
    pub fn taken_from(
        &self,
        observations: &DesignObservations,
        sorted: &Sorted,
    ) -> (DesignObservations, f64) {
        let values = DVector::from_column_slice(&sorted.values);
        let above = self.above(&values, &sorted.traces, &sorted.trace_channels);
        let greatest = above.iter().fold(0.0_f64, |most, h| most.max(h.abs()));
        let key = |trace: &Range<usize>| {
            let first = &sorted.places[trace.start];
            (first.channel, first.repeat, first.direction < 0.0)
        };
        let known: BTreeMap<TraceKey, f64> = sorted.traces.iter().map(key).zip(above).collect();
        let mut level = observations.clone();
        for reading in &mut level.readings {
            reading.value -= known.get(&trace_key(reading)).copied().unwrap_or(0.0);
        }
        (level, greatest)
    }
}

/// Readings without the heights of their traces.
pub(super) fn levelled(
    observed: &DVector<f64>,
    traces: &[Range<usize>],
    above: &[f64],
) -> DVector<f64> {
    let mut level = observed.clone();
    for (trace, above) in traces.iter().zip(above) {
        let mut own = level.rows_mut(trace.start, trace.len());
        own.add_scalar_mut(-above);
    }
    level
}

/// All channels and directions that are repeated.
fn repeated(sorted: &Sorted) -> Vec<Repeats> {
    let mut groups: BTreeMap<(usize, bool), Vec<&Range<usize>>> = BTreeMap::new();
    for trace in &sorted.traces {
        let first = &sorted.places[trace.start];
        let own = groups.entry((first.channel, first.direction < 0.0));
        own.or_default().push(trace);
    }
    let of = |((channel, _), traces): ((usize, bool), Vec<&Range<usize>>)| {
        let own: Vec<&[f64]> = traces
            .iter()
            .map(|t| &sorted.values[(*t).clone()])
            .collect();
        let mean = DVector::from_fn(own[0].len(), |k, _| {
            own.iter().map(|values| values[k]).sum::<f64>() / own.len() as f64
        });
        let above = own.iter().zip(&traces).map(|(values, trace)| {
            let above = DVector::from_column_slice(values) - &mean;
            let height = above.mean();
            let left = above.add_scalar(-height);
            (
                sorted.places[trace.start].repeat,
                height,
                left.as_slice().to_vec(),
            )
        });
        Repeats::new(channel, &above.collect::<Vec<_>>())
    };
    groups
        .into_iter()
        .filter(|(_, traces)| traces.len() > 1)
        .map(of)
        .collect()
}

/// Of each channel the heights of its traces in the order of their times.
fn courses(sorted: &Sorted, seats: &[Seat]) -> Vec<Course> {
    let mut channels: BTreeMap<usize, Vec<(f64, Height)>> = BTreeMap::new();
    for (trace, channel) in sorted.traces.iter().zip(&sorted.trace_channels) {
        let (n, places) = (trace.len() as f64, &sorted.places[trace.clone()]);
        let time = places.iter().map(|p| p.time).sum::<f64>() / n;
        let height = sorted.values[trace.clone()].iter().sum::<f64>() / n;
        let own = channels.entry(*channel).or_default();
        own.push((time, (places[0].repeat, height)));
    }
    let in_order = |(channel, mut own): (usize, Vec<(f64, Height)>)| {
        own.sort_by(|a, b| a.0.total_cmp(&b.0));
        Course {
            indicator: seats[channel].indicator,
            heights: own.into_iter().map(|(_, height)| height).collect(),
        }
    };
    channels.into_iter().map(in_order).collect()
}

/// The passes of the channels that were read each way.
fn both_ways(sorted: &Sorted, seats: &[Seat]) -> Vec<BothWays> {
    let (Some(low), Some(high)) = (sorted.positions.first(), sorted.positions.last()) else {
        return Vec::new();
    };
    let mut channels: BTreeMap<usize, [Vec<&Range<usize>>; 2]> = BTreeMap::new();
    for (trace, channel) in sorted.traces.iter().zip(&sorted.trace_channels) {
        let back = sorted.places[trace.start].direction < 0.0;
        channels.entry(*channel).or_default()[usize::from(back)].push(trace);
    }
    let of = |(channel, [forward, backward]): (usize, [Vec<&Range<usize>>; 2])| {
        let (m, n) = (forward.len() as f64, backward.len() as f64);
        if m * n == 0.0 {
            return None;
        }
        let mean = |traces: &[&Range<usize>], k: usize| {
            let sum: f64 = traces.iter().map(|t| sorted.values[t.start + k]).sum();
            sum / traces.len() as f64
        };
        let differences = sorted.positions.iter().enumerate().map(|(k, x)| {
            let along = (x - low) / (high - low);
            (2.0 * along - 1.0, mean(&backward, k) - mean(&forward, k))
        });
        // A difference of means over m and n has 1/m + 1/n of a reading's variance.
        let repeats = 2.0 * m * n / (m + n);
        BothWays::of(
            seats[channel].indicator,
            repeats,
            &differences.collect::<Vec<_>>(),
        )
    };
    channels.into_iter().filter_map(of).collect()
}
