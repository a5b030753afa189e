//! Readings gathered into cells that all traces share.
//!
//! The diagnosis compares traces position by position. Where traces have positions of their own, or
//! more of them than can be told apart, the mean of what the simultaneous fit leaves of the readings
//! in a cell, beside what that fit makes of the cell's centre, stands for one reading there: the fit
//! carries readings over the distance from where they were taken, whatever the slope. Where most traces have most
//! positions in common, the readings that single traces lack are put in (`filling.rs`) and every position stays.
//! Cost is linear in readings.

use std::collections::{BTreeMap, BTreeSet};

use super::arrangement::Arrangement;
use super::filling::{self, Lane};
use super::sorting::{TraceKey, position_key, trace_key};
use super::{Assumptions, NotDiagnosable};
use crate::reversal::designs::{self, DesignFit, DesignObservations, DesignOptions, DesignReading};
use crate::reversal::simultaneous::{self, Knots, Noise, Options, Simultaneous, Thickness};
use crate::reversal::{Channel, Direction, Observations, Reading};

/// Gathered readings of all traces, about: what a diagnosis takes a second for.
const MOST_READINGS: usize = 5000;
/// Fewest and most cells that readings are gathered into for want of speed alone.
const CELLS: (usize, usize) = (150, 400);
/// Positions are gathered for want of speed only where that is worth their detail.
const WORTH: f64 = 1.5;
/// Readings that are lacking are put in where that keeps so many times the cells.
const WORTH_FILLING: f64 = 1.2;
/// Least share of the readings at positions that all traces have for the rest to be left out.
const SHARED: f64 = 0.95;

/// How readings were gathered.
#[derive(Debug, Clone, PartialEq)]
pub struct Gathered {
    /// Cells of each trace.
    pub cells: usize,
    /// Mean number of readings in a cell of one trace.
    pub readings_per_cell: f64,
    /// Readings that no cell holds: outside the range that all traces have.
    pub beyond: usize,
    /// Time that the readings of each cell of each trace took, s, in the order of the readings made.
    pub(super) spans: Vec<f64>,
    /// The readings made that were put in, ascending.
    pub(super) lacking: Vec<usize>,
}

impl Gathered {
    /// Readings that single traces lack, which were put in.
    pub fn filled(&self) -> usize {
        self.lacking.len()
    }

    /// The same of a measurement that is not made yet.
    pub(super) fn planned(self) -> Self {
        Self {
            spans: Vec::new(),
            lacking: Vec::new(),
            ..self
        }
    }
}

/// Traces of readings: indices in the order of the file.
pub(super) type Traces = BTreeMap<TraceKey, Vec<usize>>;

/// The traces of some readings.
pub(super) fn traces_of(observations: &DesignObservations) -> Traces {
    let mut traces = Traces::new();
    for (k, reading) in observations.readings.iter().enumerate() {
        traces.entry(trace_key(reading)).or_default().push(k);
    }
    traces
}

/// Whether readings must be gathered, from what all traces share.
pub(super) fn is_needed(traces: usize, shared: usize, readings: usize) -> bool {
    ((shared * traces) as f64) < SHARED * readings as f64
        || shared as f64 > WORTH * most_cells(traces) as f64
}

fn most_cells(traces: usize) -> usize {
    (MOST_READINGS / traces.max(1)).clamp(CELLS.0, CELLS.1)
}

/// A simultaneous fit of the readings.
pub(super) enum Carrier<'a> {
    /// Of the four channels.
    Four(&'a Simultaneous),
    /// Of another design.
    Design(&'a DesignFit),
}

impl Carrier<'_> {
    /// What a channel would read at a slide position, µm.
    fn predict(&self, channel: usize, name: &str, x: f64) -> Result<f64, NotDiagnosable> {
        let predicted = match self {
            Self::Design(fit) => fit.predict(channel, x),
            Self::Four(fit) => match Channel::from_name(name) {
                Some(four) => fit.predict(four, x).map(|there| there.value),
                None => return Err(NotDiagnosable::NoFit(format!("{name} is no channel of it"))),
            },
        };
        predicted.map_err(|why| NotDiagnosable::NoFit(why.to_string()))
    }

    fn residuals(&self) -> &[f64] {
        match self {
            Self::Four(fit) => &fit.residuals,
            Self::Design(fit) => &fit.residuals,
        }
    }
}

/// The simultaneous fit of the four channels under the same assumptions.
pub(super) fn fit_four(
    observations: &DesignObservations,
    assumptions: Assumptions,
) -> Result<Simultaneous, NotDiagnosable> {
    let options = Options {
        convention: assumptions.convention,
        thickness: assumptions
            .thickness
            .map_or(Thickness::NotKnown, Thickness::Known),
        noise: assumptions.noise.map_or(Noise::Estimated, Noise::Declared),
        knots: Knots::Chosen,
        ..Options::default()
    };
    simultaneous::fit(&as_four(observations), &options)
        .map_err(|why| NotDiagnosable::NoFit(why.to_string()))
}

/// Readings of 1A, 1B, 2A, 2B as theirs.
fn as_four(observations: &DesignObservations) -> Observations {
    let channels = observations.design.channels();
    let reading = |r: &DesignReading| {
        Some(Reading {
            channel: Channel::from_name(&channels[r.channel].name)?,
            repeat: r.repeat,
            direction: r.direction,
            time: r.time,
            x: r.x,
            value: r.value,
        })
    };
    Observations {
        readings: observations.readings.iter().filter_map(reading).collect(),
    }
}

/// The simultaneous fit of another design.
pub(super) fn fit_design(
    observations: &DesignObservations,
    arrangement: &Arrangement,
    assumptions: Assumptions,
) -> Result<DesignFit, NotDiagnosable> {
    let options = DesignOptions {
        zero: arrangement.zero(),
        thickness_mm: assumptions.thickness.unwrap_or(0.0),
        noise: assumptions.noise.map_or(Noise::Estimated, Noise::Declared),
        ..DesignOptions::default()
    };
    designs::fit(observations, &options).map_err(|why| NotDiagnosable::NoFit(why.to_string()))
}

/// Gathers readings by a fit to them.
pub(super) fn gather(
    observations: &DesignObservations,
    mut traces: Traces,
    fit: &Carrier<'_>,
) -> Result<(DesignObservations, Gathered), NotDiagnosable> {
    let readings = &observations.readings;
    for rows in traces.values_mut() {
        rows.sort_by(|a, b| readings[*a].x.total_cmp(&readings[*b].x));
    }
    let mut kept = traces.clone();
    drop_short(&mut kept, readings);
    let strict = edges(&kept, readings);
    let cells = strict.as_ref().map_or(0, |edges| edges.len() - 1);
    let edges = match edges_to_fill(&traces, readings) {
        Some(edges) if (edges.len() - 1) as f64 > WORTH_FILLING * cells as f64 => edges,
        _ => {
            traces = kept;
            strict.ok_or(NotDiagnosable::RangesDiffer)?
        }
    };
    let members: Vec<(TraceKey, Vec<&[usize]>)> = (traces.iter())
        .map(|(key, rows)| (*key, by_cell(rows, readings, &edges)))
        .collect();
    let cells = edges.len() - 1;
    let mut sums = vec![(0.0, 0.0); cells];
    for (_, inside) in &members {
        for (sum, own) in sums.iter_mut().zip(inside) {
            sum.0 += own.iter().map(|k| readings[*k].x).sum::<f64>();
            sum.1 += own.len() as f64;
        }
    }
    let centres: Vec<f64> = sums.iter().map(|(sum, count)| sum / count).collect();
    let residuals = fit.residuals();
    let lanes: Vec<Lane> = (members.iter())
        .map(|(key, inside)| {
            let left = |own: &&[usize]| mean(own, |k| residuals[k]);
            (*key, inside.iter().map(left).collect())
        })
        .collect();
    let left = filling::filled(&lanes);
    let names = observations.design.channels();
    let mut made = Vec::new();
    let mut spans = Vec::new();
    for ((key, inside), left) in members.iter().zip(&left) {
        let (channel, repeat, backward) = *key;
        let times = times_of(inside, readings);
        for (k, own) in inside.iter().enumerate() {
            let there = fit.predict(channel, &names[channel].name, centres[k])?;
            made.push(DesignReading {
                channel,
                repeat,
                direction: if backward {
                    Direction::Backward
                } else {
                    Direction::Forward
                },
                time: times.as_ref().map(|times| times[k]),
                x: centres[k],
                value: there + left[k],
            });
            spans.push(span_of(own, readings));
        }
    }
    let held: f64 = sums.iter().map(|(_, count)| count).sum();
    let own = members.iter().flat_map(|(_, inside)| inside).enumerate();
    let lacking: Vec<usize> = (own.filter(|(_, own)| own.is_empty()))
        .map(|(k, _)| k)
        .collect();
    let gathered = Gathered {
        cells,
        readings_per_cell: held / (made.len() - lacking.len()) as f64,
        beyond: readings.len() - held as usize,
        spans,
        lacking,
    };
    let made = DesignObservations {
        design: observations.design.clone(),
        readings: made,
    };
    Ok((made, gathered))
}

/// The mean over rows, where there are any.
fn mean(rows: &[usize], value: impl Fn(usize) -> f64) -> Option<f64> {
    let sum: f64 = rows.iter().map(|k| value(*k)).sum();
    (!rows.is_empty()).then(|| sum / rows.len() as f64)
}

/// The mean time of each cell of a trace, s, where all readings have one; of a cell without readings that
/// between its neighbours.
fn times_of(inside: &[&[usize]], readings: &[DesignReading]) -> Option<Vec<f64>> {
    let timed = |own: &&[usize]| own.iter().all(|k| readings[*k].time.is_some());
    if !inside.iter().all(timed) {
        return None;
    }
    let known: Vec<(f64, f64)> = (inside.iter().enumerate())
        .filter_map(|(k, own)| {
            let time = mean(own, |k| readings[k].time.unwrap_or(f64::NAN))?;
            Some((k as f64, time))
        })
        .collect();
    let at = |k: usize| {
        let k = k as f64;
        let next = known.partition_point(|(cell, _)| *cell < k);
        if let Some((_, time)) = known.get(next).filter(|(cell, _)| *cell == k) {
            return *time;
        }
        // Beyond the ends on the line of the two nearest.
        let from = next.clamp(1, known.len() - 1);
        let ((a, s), (b, t)) = (known[from - 1], known[from]);
        s + (t - s) * (k - a) / (b - a)
    };
    (known.len() > 1).then(|| (0..inside.len()).map(at).collect())
}

/// The time that the readings of a cell took, s: readings that follow each other evenly take one interval more than
/// lies between the first and the last; without times each cell takes a second.
fn span_of(own: &[usize], readings: &[DesignReading]) -> f64 {
    let count = own.len() as f64;
    if count < 2.0 {
        return 0.0;
    }
    let times: Option<Vec<f64>> = own.iter().map(|k| readings[*k].time).collect();
    times.map_or(1.0, |times| {
        let first = times.iter().copied().fold(f64::INFINITY, f64::min);
        let last = times.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        ((last - first) * count / (count - 1.0)).max(0.0)
    })
}

/// Leaves out traces so short that the others together lose more readings by them than they bring;
/// of every channel the longest stays.
fn drop_short(traces: &mut Traces, readings: &[DesignReading]) {
    let span = |rows: &[usize]| match (rows.first(), rows.last()) {
        (Some(first), Some(last)) => readings[*last].x - readings[*first].x,
        _ => 0.0,
    };
    let mut order: Vec<(f64, TraceKey)> = traces
        .iter()
        .map(|(key, rows)| (span(rows), *key))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let longest: BTreeMap<usize, TraceKey> = order.iter().map(|(_, key)| (key.0, *key)).collect();
    let spare: Vec<TraceKey> = order
        .into_iter()
        .map(|(_, key)| key)
        .filter(|key| longest.get(&key.0) != Some(key))
        .collect();
    // Which is dropped first; the longest never are.
    let turn: BTreeMap<&TraceKey, usize> = spare.iter().zip(0..).collect();
    let turned: Vec<(usize, &Vec<usize>)> = traces
        .iter()
        .map(|(key, rows)| (turn.get(key).copied().unwrap_or(usize::MAX), rows))
        .collect();
    let kept = |dropped: usize| -> usize {
        let others = || turned.iter().filter(|(turn, _)| *turn >= dropped);
        let (low, high) = common(others().map(|(_, rows)| *rows), readings);
        others()
            .map(|(_, rows)| within(rows, readings, low, high).len())
            .sum()
    };
    let best = (0..=spare.len())
        .rev()
        .max_by_key(|dropped| kept(*dropped))
        .unwrap_or(0);
    for key in &spare[..best] {
        traces.remove(key);
    }
}

/// The range that all traces have.
fn common<'a>(
    traces: impl Iterator<Item = &'a Vec<usize>>,
    readings: &[DesignReading],
) -> (f64, f64) {
    traces.fold((f64::NEG_INFINITY, f64::INFINITY), |(low, high), rows| {
        let at = |k: Option<&usize>| k.map_or(f64::NAN, |k| readings[*k].x);
        (low.max(at(rows.first())), high.min(at(rows.last())))
    })
}

/// Rows, in order of position, between two positions.
fn within<'a>(rows: &'a [usize], readings: &[DesignReading], low: f64, high: f64) -> &'a [usize] {
    let from = rows.partition_point(|k| readings[*k].x < low);
    let to = rows.partition_point(|k| readings[*k].x <= high);
    &rows[from..to.max(from)]
}

/// Edges of cells of which every trace has readings in each, the last cell with its upper edge in it.
///
/// Cells of equally many readings of all traces, and cells about each position of the trace with the fewest: those
/// of the two that leave more once every cell without readings of some trace is joined to its neighbour.
fn edges(traces: &Traces, readings: &[DesignReading]) -> Option<Vec<f64>> {
    let (low, high) = common(traces.values(), readings);
    // Ends of scanned traces differ by a spacing or so: what lies a spacing outside belongs to the end.
    let spacing = traces
        .values()
        .map(|rows| (readings[rows[rows.len() - 1]].x - readings[rows[0]].x) / rows.len() as f64)
        .fold(0.0, f64::max);
    let (low, high) = (low - spacing, high + spacing);
    let of = |rows: &Vec<usize>| -> Vec<f64> {
        within(rows, readings, low, high)
            .iter()
            .map(|k| readings[*k].x)
            .collect()
    };
    let positions: Vec<Vec<f64>> = traces.values().map(of).collect();
    let coarsest = positions.iter().min_by_key(|x| x.len())?;
    let cells = coarsest.len().min(most_cells(traces.len()));
    let mut pooled: Vec<f64> = positions.iter().flatten().copied().collect();
    pooled.sort_by(f64::total_cmp);
    let even = (1..cells).map(|k| {
        let at = k * pooled.len() / cells;
        0.5 * (pooled[at - 1] + pooled[at])
    });
    let about = (1..cells).map(|k| {
        let at = k * coarsest.len() / cells;
        0.5 * (coarsest[at - 1] + coarsest[at])
    });
    let ends = |inner: Vec<f64>| {
        let mut edges = vec![low];
        edges.extend(inner.into_iter().filter(|x| *x > low && *x < high));
        edges.push(high);
        edges.dedup();
        joined(edges, &positions)
    };
    let (even, about) = (ends(even.collect()), ends(about.collect()));
    let best = if about.len() > even.len() {
        about
    } else {
        even
    };
    (best.len() > super::FEWEST_POSITIONS).then_some(best)
}

/// Edges of cells about the positions that at least half of the traces have, where there are few and what
/// single traces lack can be put in.
fn edges_to_fill(traces: &Traces, readings: &[DesignReading]) -> Option<Vec<f64>> {
    let mut read: BTreeMap<i64, (f64, usize)> = BTreeMap::new();
    for k in traces.values().flatten() {
        let x = readings[*k].x;
        read.entry(position_key(x)).or_insert((x, 0)).1 += 1;
        if read.len() > most_cells(traces.len()) {
            return None;
        }
    }
    let kept: Vec<(i64, f64)> = (read.into_iter())
        .filter(|(_, (_, count))| 2 * count >= traces.len())
        .map(|(key, (x, _))| (key, x))
        .collect();
    if kept.len() <= super::FEWEST_POSITIONS {
        return None;
    }
    let present = |rows: &Vec<usize>| {
        let own: BTreeSet<i64> = rows.iter().map(|k| position_key(readings[*k].x)).collect();
        kept.iter().map(|(key, _)| own.contains(key)).collect()
    };
    let by_trace: Vec<(TraceKey, Vec<bool>)> = (traces.iter())
        .map(|(key, rows)| (*key, present(rows)))
        .collect();
    if !filling::can_be_told(&by_trace) {
        return None;
    }
    let half = |a: usize, b: usize| 0.5 * (kept[a].1 + kept[b].1);
    let last = kept.len() - 1;
    let mut edges = vec![2.0 * kept[0].1 - half(0, 1)];
    edges.extend((0..last).map(|k| half(k, k + 1)));
    edges.push(2.0 * kept[last].1 - half(last - 1, last));
    Some(edges)
}

/// Edges without those that leave a trace without readings in a cell.
fn joined(edges: Vec<f64>, positions: &[Vec<f64>]) -> Vec<f64> {
    let mut kept = vec![edges[0]];
    let last = edges[edges.len() - 1];
    let filled = |from: f64, to: f64| {
        positions.iter().all(|x| {
            let first = x.partition_point(|v| *v < from);
            x.get(first)
                .is_some_and(|v| *v < to || (to == last && *v <= to))
        })
    };
    for edge in &edges[1..] {
        let from = kept[kept.len() - 1];
        if *edge == last {
            // The last cell takes its neighbours in until it is filled.
            while kept.len() > 1 && !filled(kept[kept.len() - 1], last) {
                kept.pop();
            }
            kept.push(last);
        } else if filled(from, *edge) {
            kept.push(*edge);
        }
    }
    kept
}

/// The rows of a trace in each cell.
fn by_cell<'a>(rows: &'a [usize], readings: &[DesignReading], edges: &[f64]) -> Vec<&'a [usize]> {
    let mut at = rows.partition_point(|k| readings[*k].x < edges[0]);
    let cells = edges.len() - 1;
    (0..cells)
        .map(|cell| {
            let upper = edges[cell + 1];
            let next = if cell + 1 == cells {
                rows.partition_point(|k| readings[*k].x <= upper)
            } else {
                rows.partition_point(|k| readings[*k].x < upper)
            };
            let own = &rows[at..next.max(at)];
            at = next.max(at);
            own
        })
        .collect()
}
