//! Readings gathered into cells that all traces share.
//!
//! The diagnosis compares traces position by position. Where traces have positions of their own, or
//! more of them than can be told apart, the mean of what the simultaneous fit leaves of the readings
//! in a cell, beside what that fit makes of the cell's centre, stands for one reading there: the fit
//! carries readings over the distance from where they were taken, whatever the slope. Cost is linear in readings.

use std::collections::BTreeMap;

use super::arrangement::Arrangement;
use super::sorting::{TraceKey, trace_key};
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
}

impl Gathered {
    /// The same of a measurement that is not made yet.
    pub(super) fn planned(self) -> Self {
        Self {
            spans: Vec::new(),
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
    drop_short(&mut traces, readings);
    let edges = edges(&traces, readings).ok_or(NotDiagnosable::RangesDiffer)?;
    let cells = edges.len() - 1;
    let mut sums = vec![(0.0, 0.0); cells];
    let mut members: Vec<(TraceKey, Vec<&[usize]>)> = Vec::new();
    for (key, rows) in &traces {
        let inside = by_cell(rows, readings, &edges);
        for (sum, own) in sums.iter_mut().zip(&inside) {
            sum.0 += own.iter().map(|k| readings[*k].x).sum::<f64>();
            sum.1 += own.len() as f64;
        }
        members.push((*key, inside));
    }
    let centres: Vec<f64> = sums.iter().map(|(sum, count)| sum / count).collect();
    let names = observations.design.channels();
    let residuals = fit.residuals();
    let mut made = Vec::new();
    let mut spans = Vec::new();
    for ((channel, repeat, backward), inside) in &members {
        for (own, centre) in inside.iter().zip(&centres) {
            let count = own.len() as f64;
            let mean =
                |value: &dyn Fn(usize) -> f64| own.iter().map(|k| value(*k)).sum::<f64>() / count;
            let there = fit.predict(*channel, &names[*channel].name, *centre)?;
            let times: Option<Vec<f64>> = own.iter().map(|k| readings[*k].time).collect();
            made.push(DesignReading {
                channel: *channel,
                repeat: *repeat,
                direction: if *backward {
                    Direction::Backward
                } else {
                    Direction::Forward
                },
                time: times.as_ref().map(|t| t.iter().sum::<f64>() / count),
                x: *centre,
                value: there + mean(&|k| residuals[k]),
            });
            let (first, last) = times
                .iter()
                .flatten()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| {
                    (low.min(*t), high.max(*t))
                });
            // Readings that follow each other evenly take one interval more than lies between the
            // first and the last; without times each cell takes a second.
            let span = match times {
                Some(_) if count > 1.0 => (last - first) * count / (count - 1.0),
                None if count > 1.0 => 1.0,
                _ => 0.0,
            };
            spans.push(span.max(0.0));
        }
    }
    let held: f64 = sums.iter().map(|(_, count)| count).sum();
    let gathered = Gathered {
        cells,
        readings_per_cell: held / (cells * traces.len()) as f64,
        beyond: readings.len() - held as usize,
        spans,
    };
    let made = DesignObservations {
        design: observations.design.clone(),
        readings: made,
    };
    Ok((made, gathered))
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
