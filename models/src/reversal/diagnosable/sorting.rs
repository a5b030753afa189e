//! Readings sorted into traces on shared positions.

use std::collections::BTreeMap;
use std::ops::Range;

use super::NotDiagnosable;
use crate::model::Place;
use crate::reversal::{Channel, Direction, Observations};

/// Seconds between readings where the file has no times.
const ASSUMED_INTERVAL: f64 = 1.0;

/// Channel, repeat, and whether it runs backward.
type TraceKey = (Channel, u32, bool);

/// Readings in traces.
pub(super) struct Sorted {
    pub values: Vec<f64>,
    pub places: Vec<Place>,
    pub traces: Vec<Range<usize>>,
    pub trace_channels: Vec<Channel>,
    pub positions: Vec<f64>,
    pub timed: bool,
    pub left_out: usize,
}

/// Position (mm), value (µm) and time (s) of a reading.
type Sample = (f64, f64, Option<f64>);

impl Sorted {
    pub fn new(observations: &Observations) -> Result<Self, NotDiagnosable> {
        let mut traces: BTreeMap<TraceKey, BTreeMap<i64, Sample>> = BTreeMap::new();
        let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
        for reading in &observations.readings {
            let key = (
                reading.channel,
                reading.repeat,
                reading.direction == Direction::Backward,
            );
            let place = position_key(reading.x);
            let trace = traces.entry(key).or_default();
            if trace
                .insert(place, (reading.x, reading.value, reading.time))
                .is_none()
            {
                *counts.entry(place).or_default() += 1;
            }
        }
        let shared: Vec<i64> = counts
            .iter()
            .filter(|(_, count)| **count == traces.len())
            .map(|(place, _)| *place)
            .collect();
        if shared.len() < 5 {
            return Err(NotDiagnosable::PositionsDiffer {
                shared: shared.len(),
                all: counts.len(),
            });
        }
        let n = shared.len();
        let timed = observations.readings.iter().all(|r| r.time.is_some());
        let order = assumed_order(traces.keys());
        let present: Vec<Channel> = observations.channels();
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
            let channel_index = present.iter().position(|c| *c == channel).unwrap_or(0);
            let start = sorted.values.len();
            for (k, place) in shared.iter().enumerate() {
                let Some(&(x, value, time)) = trace.get(place) else {
                    continue;
                };
                let step = if backward { n - 1 - k } else { k };
                let assumed = (order[key] * n + step) as f64 * ASSUMED_INTERVAL;
                sorted.values.push(value);
                sorted.places.push(Place {
                    channel: channel_index,
                    x,
                    time: if timed {
                        time.unwrap_or(assumed)
                    } else {
                        assumed
                    },
                    repeat,
                    direction: if backward { -1.0 } else { 1.0 },
                    cell: channel_index * n + k,
                });
                if sorted.traces.is_empty() {
                    sorted.positions.push(x);
                }
            }
            sorted.traces.push(start..sorted.values.len());
            sorted.trace_channels.push(channel);
        }
        sorted.left_out = observations.readings.len() - sorted.values.len();
        Ok(sorted)
    }
}

/// Positions closer than 0.1 µm are the same.
fn position_key(x: f64) -> i64 {
    (x * 1e4).round() as i64
}

/// The order in which traces are taken where no times are given: first all repeats in the first
/// spindle position, then in the second, each forward and then backward, both indicators at once.
fn assumed_order<'a>(
    keys: impl Iterator<Item = &'a TraceKey> + Clone,
) -> BTreeMap<TraceKey, usize> {
    let pass = |key: &TraceKey| (key.0.spindle_sign() < 0.0, key.1, key.2);
    let mut passes: Vec<_> = keys.clone().map(pass).collect();
    passes.sort_unstable();
    passes.dedup();
    keys.map(|key| (*key, passes.partition_point(|p| *p < pass(key))))
        .collect()
}
