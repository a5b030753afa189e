//! Readings sorted into traces on shared positions.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::model::Place;
use crate::reversal::Direction;
use crate::reversal::designs::{DesignObservations, DesignReading};

/// Seconds between readings where the file has no times.
const ASSUMED_INTERVAL: f64 = 1.0;

/// Channel by its place, repeat, and whether it runs backward.
pub(super) type TraceKey = (usize, u32, bool);

/// Readings in traces.
pub(super) struct Sorted {
    pub values: Vec<f64>,
    pub places: Vec<Place>,
    pub traces: Vec<Range<usize>>,
    pub trace_channels: Vec<usize>,
    pub positions: Vec<f64>,
    pub timed: bool,
    pub left_out: usize,
}

/// Position (mm), value (µm) and time (s) of a reading.
type Sample = (f64, f64, Option<f64>);

impl Sorted {
    /// The readings at positions that all traces share; `positions`: by channel, that of the spindle.
    pub fn new(observations: &DesignObservations, positions: &[usize], shared: &[i64]) -> Self {
        let mut traces: BTreeMap<TraceKey, BTreeMap<i64, Sample>> = BTreeMap::new();
        for reading in &observations.readings {
            let sample = (reading.x, reading.value, reading.time);
            let trace = traces.entry(trace_key(reading)).or_default();
            trace.insert(position_key(reading.x), sample);
        }
        let n = shared.len();
        let timed = observations.readings.iter().all(|r| r.time.is_some());
        // Clocks may count from anywhere.
        let began = observations.readings.iter().filter_map(|r| r.time);
        let began = began.fold(f64::INFINITY, f64::min);
        let order = assumed_order(traces.keys(), positions);
        let mut sorted = Self {
            values: Vec::new(),
            places: Vec::new(),
            traces: Vec::new(),
            trace_channels: Vec::new(),
            positions: Vec::new(),
            timed,
            left_out: 0,
        };
        for (key, trace) in &traces {
            let (channel, repeat, backward) = *key;
            let start = sorted.values.len();
            for (k, place) in shared.iter().enumerate() {
                let Some(&(x, value, time)) = trace.get(place) else {
                    continue;
                };
                let step = if backward { n - 1 - k } else { k };
                let assumed = (order[key] * n + step) as f64 * ASSUMED_INTERVAL;
                sorted.values.push(value);
                sorted.places.push(Place {
                    channel,
                    x,
                    time: if timed {
                        time.map_or(assumed, |time| time - began)
                    } else {
                        assumed
                    },
                    repeat,
                    direction: if backward { -1.0 } else { 1.0 },
                    cell: channel * n + k,
                });
                if sorted.traces.is_empty() {
                    sorted.positions.push(x);
                }
            }
            sorted.traces.push(start..sorted.values.len());
            sorted.trace_channels.push(channel);
        }
        sorted.left_out = observations.readings.len() - sorted.values.len();
        sorted
    }
}

/// The positions that all of so many traces have, ascending.
pub(super) fn shared(observations: &DesignObservations, traces: usize) -> Vec<i64> {
    let mut numbers: BTreeMap<TraceKey, u32> = BTreeMap::new();
    let mut seen: Vec<(i64, u32)> = Vec::with_capacity(observations.readings.len());
    for reading in &observations.readings {
        let next = numbers.len() as u32;
        let trace = *numbers.entry(trace_key(reading)).or_insert(next);
        seen.push((position_key(reading.x), trace));
    }
    seen.sort_unstable();
    seen.dedup();
    seen.chunk_by(|a, b| a.0 == b.0)
        .filter(|by| by.len() == traces)
        .map(|by| by[0].0)
        .collect()
}

/// The trace of a reading.
pub(super) fn trace_key(reading: &DesignReading) -> TraceKey {
    let backward = reading.direction == Direction::Backward;
    (reading.channel, reading.repeat, backward)
}

/// Positions closer than 0.1 µm are the same.
pub(super) fn position_key(x: f64) -> i64 {
    (x * 1e4).round() as i64
}

/// The order in which traces are taken where no times are given: all repeats in the first spindle
/// position, then in the next, each forward and then backward, all indicators at once.
fn assumed_order<'a>(
    keys: impl Iterator<Item = &'a TraceKey> + Clone,
    positions: &[usize],
) -> BTreeMap<TraceKey, usize> {
    let pass = |key: &TraceKey| (positions[key.0], key.1, key.2);
    let mut passes: Vec<_> = keys.clone().map(pass).collect();
    passes.sort_unstable();
    passes.dedup();
    keys.map(|key| (*key, passes.partition_point(|p| *p < pass(key))))
        .collect()
}
