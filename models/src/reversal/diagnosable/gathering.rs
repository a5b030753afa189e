//! Readings gathered into cells that all traces share.
//!
//! The diagnosis compares traces position by position. Where traces have positions of their own, or
//! more of them than can be told apart, the mean of what the simultaneous fit leaves of the readings
//! in a cell, beside what that fit makes of the cell's centre, stands for one reading there: the fit
//! carries readings over the distance from where they were taken, whatever the slope. With them goes what it takes up
//! of an effect: most of what is in all repeats of a channel, the lesser part of what is in one of several, which therefore
//! acts where it was read ([`Linearised::taken_at`](super::Linearised::taken_at)). Where most traces have most
//! positions in common, the readings that single traces lack are put in (`filling.rs`) and every position stays.
//! Cost is linear in readings.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::arrangement::Arrangement;
use super::between_grids;
use super::carrier::{Carrier, Route};
use super::edges::{by_cell, drop_short, edges_of_all, edges_to_fill, spread_of_ends};
use super::filling::{self, Lane};
use super::missed::{Carrying, Missed, are_apart};
use super::reach;
use super::sorting::{TraceKey, trace_key};
use super::{Assumptions, NotDiagnosable};
use crate::reversal::Direction;
use crate::reversal::cells::Union;
use crate::reversal::designs::{DesignChannel, DesignObservations, DesignReading};
use crate::reversal::straight_line::{StraightLine, slopes_of_halves};

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

/// Least share of the cells to keep where those at the ends are left out.
const KEPT: f64 = 0.95;

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
    /// Variance of what the forms differ by in a cell from channel to channel (`between_grids.rs`).
    pub(super) scatter: f64,
    /// Over how much the first positions of the traces spread, and the last, mm: a cell at most.
    pub(super) ends: [f64; 2],
    /// Whether each channel's traces were read at the same places.
    pub(super) repeated: bool,
    /// The line of a profile over all positions that were read, from its values at the cells' centres.
    pub(super) gauge: StraightLine,
    /// The same slope from every second centre, and from the others; none where every position is one.
    pub(super) halves: Vec<DVector<f64>>,
    /// How far beyond its cell's centre each reading made was taken, in the mean, mm, in their order.
    pub(super) offsets: Vec<f64>,
}

impl Gathered {
    /// Readings that single traces lack, which were put in.
    pub fn filled(&self) -> usize {
        self.lacking.len()
    }

    /// What the forms differ by in a cell from channel to channel, where these are read at positions of their own:
    /// standard deviation, µm.
    pub fn between_grids(&self) -> f64 {
        self.scatter.sqrt()
    }

    /// The same of a measurement that is not made yet.
    pub(super) fn planned(self) -> Self {
        Self {
            spans: Vec::new(),
            lacking: Vec::new(),
            offsets: Vec::new(),
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

/// Most cells of each of so many traces.
pub(super) fn most_cells(traces: usize) -> usize {
    (MOST_READINGS / traces.max(1)).clamp(CELLS.0, CELLS.1)
}

/// Gathers readings by a fit to them.
pub(super) fn gather(
    observations: &DesignObservations,
    mut traces: Traces,
    fit: Carrier<'_>,
    arrangement: &Arrangement,
    assumptions: Assumptions,
) -> Result<(DesignObservations, Gathered), NotDiagnosable> {
    let readings = &observations.readings;
    for rows in traces.values_mut() {
        rows.sort_by(|a, b| readings[*a].x.total_cmp(&readings[*b].x));
    }
    let mut kept = traces.clone();
    drop_short(&mut kept, readings);
    let strict = edges_of_all(&kept, readings);
    let cells = strict.as_ref().map_or(0, |edges| edges.len() - 1);
    let to_fill = edges_to_fill(&traces, readings)
        .filter(|edges| (edges.len() - 1) as f64 > WORTH_FILLING * cells as f64);
    let on_one_grid = to_fill.is_some();
    let (edges, ends) = if let Some(edges) = to_fill {
        (edges, [0.0; 2])
    } else {
        traces = kept;
        let ends = spread_of_ends(&traces, readings);
        (strict.ok_or(NotDiagnosable::RangesDiffer)?, ends)
    };
    let mut members: Vec<(TraceKey, Vec<&[usize]>)> = (traces.iter())
        .map(|(key, rows)| (*key, by_cell(rows, readings, &edges)))
        .collect();
    let mut widths: Vec<f64> = edges.windows(2).map(|own| own[1] - own[0]).collect();
    if !on_one_grid {
        reach::leave_out_gaps(&mut members, readings, &mut widths);
    }
    let cells = widths.len();
    let mut sums = vec![(0.0, 0.0); cells];
    for (_, inside) in &members {
        for (sum, own) in sums.iter_mut().zip(inside) {
            sum.0 += own.iter().map(|k| readings[*k].x).sum::<f64>();
            sum.1 += own.len() as f64;
        }
    }
    let centres: Vec<f64> = sums.iter().map(|(sum, count)| sum / count).collect();
    let names = observations.design.channels();
    let width = widths.iter().sum::<f64>() / cells as f64;
    let routes = routes(&members, readings, &centres, names);
    let carrying = Carrying {
        observations,
        arrangement,
        assumptions,
        most: most_cells(traces.len()),
        routes: &routes,
        centres: &centres,
    };
    let fit = carrying.refined(fit);
    // Traces of a channel that were read at places of their own tell what is between those of one.
    let repeated = are_repeated(&members, readings, width);
    let apart = between_grids::ALIKE * width;
    let apart = repeated && are_apart(&members, readings, &centres, apart);
    let (fit, missed) = if apart && !on_one_grid {
        carrying.beside_misfit(fit, &members)
    } else {
        (fit, Missed::default())
    };
    let residuals = fit.residuals();
    let told = fit.told();
    let from = centres.partition_point(|x| *x < told[0]);
    let to = centres.partition_point(|x| *x <= told[1]).max(from);
    // Where forms are smooth the fit's cells are long. Readings of one grid are carried nowhere.
    let enough = |from: usize, to: usize| to as f64 - from as f64 >= KEPT * cells as f64;
    let (from, to) = if !on_one_grid && enough(from, to) {
        (from, to)
    } else {
        (0, cells)
    };
    let [first, last] = reach::are_beyond(&members, readings, &centres, width);
    let inner = (
        from.max(usize::from(first)),
        to.min(cells - usize::from(last)),
    );
    let (from, to) = if !on_one_grid && enough(inner.0, inner.1) {
        inner
    } else {
        (from, to)
    };
    let (centres, sums, cells) = (&centres[from..to], &sums[from..to], to - from);
    for (_, inside) in &mut members {
        *inside = inside[from..to].to_vec();
    }
    let lanes: Vec<Lane> = (members.iter())
        .map(|(key, inside)| {
            let left = |own: &&[usize]| mean(own, |k| residuals[k]);
            (*key, inside.iter().map(left).collect())
        })
        .collect();
    let left = filling::filled(&lanes);
    let mut made = Vec::new();
    let mut spans = Vec::new();
    for ((key, inside), left) in members.iter().zip(&left) {
        let (channel, repeat, backward) = *key;
        let times = times_of(inside, readings);
        for (k, own) in inside.iter().enumerate() {
            let there = fit.predict(channel, &names[channel].name, centres[k])?
                + missed.at(channel, centres[k]);
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
    let lanes: Vec<between_grids::Lane> = (members.iter().zip(made.chunks(cells)))
        .map(|((key, inside), own)| between_grids::Lane {
            channel: key.0,
            offsets: (inside.iter().zip(centres))
                .map(|(own, centre)| {
                    mean(own, |k| readings[k].x).map_or(0.0, |x| (x - centre) / width)
                })
                .collect(),
            values: own.iter().map(|reading| reading.value).collect(),
        })
        .collect();
    let offsets = lanes.iter().flat_map(|lane| &lane.offsets);
    let offsets = offsets.map(|parts| parts * width).collect();
    let closures: Vec<Vec<f64>> = arrangement.closures().map(|own| own.weights).collect();
    let positions = positions_of(&members, readings);
    let halves = if on_one_grid {
        Vec::new()
    } else {
        slopes_of_halves(&positions, centres)
    };
    let gathered = Gathered {
        cells,
        readings_per_cell: held / (made.len() - lacking.len()) as f64,
        beyond: readings.len() - held as usize,
        spans,
        lacking,
        scatter: between_grids::variance(&lanes, &closures),
        ends: ends.map(|spread| spread.min(width)),
        repeated,
        gauge: StraightLine::carried(&positions, centres),
        halves,
        offsets,
    };
    let made = DesignObservations {
        design: observations.design.clone(),
        readings: made,
    };
    Ok((made, gathered))
}

/// All positions that were read in the cells, growing, each once.
fn positions_of(members: &[(TraceKey, Vec<&[usize]>)], readings: &[DesignReading]) -> Vec<f64> {
    let of = |inside: &Vec<&[usize]>| -> Vec<f64> {
        let rows = inside.iter().copied().flatten();
        rows.map(|k| readings[*k].x).collect()
    };
    let by_trace: Vec<Vec<f64>> = members.iter().map(|(_, inside)| of(inside)).collect();
    Union::of(by_trace.iter().map(Vec::as_slice)).collect()
}

/// Whether the traces of each channel were read at the same places in every cell where they were read, but for a
/// thousandth of it.
fn are_repeated(
    members: &[(TraceKey, Vec<&[usize]>)],
    readings: &[DesignReading],
    width: f64,
) -> bool {
    let mut first: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    members.iter().all(|((channel, _, _), inside)| {
        let mut cells = inside.iter().enumerate();
        cells.all(|(k, own)| {
            mean(own, |k| readings[k].x).is_none_or(|x| {
                let known = *first.entry((*channel, k)).or_insert(x);
                (x - known).abs() <= 1e-3 * width
            })
        })
    })
}

/// From where each channel's readings in a cell are carried.
fn routes(
    members: &[(TraceKey, Vec<&[usize]>)],
    readings: &[DesignReading],
    centres: &[f64],
    channels: &[DesignChannel],
) -> Vec<Route> {
    let mut routes = Vec::new();
    for (channel, named) in channels.iter().enumerate() {
        let own: Vec<&Vec<&[usize]>> = (members.iter())
            .filter(|(key, _)| key.0 == channel)
            .map(|(_, inside)| inside)
            .collect();
        for (k, centre) in centres.iter().enumerate() {
            let rows: Vec<usize> = own.iter().flat_map(|cells| cells[k]).copied().collect();
            if let Some(from) = mean(&rows, |k| readings[k].x) {
                routes.push(Route {
                    channel: named.name.clone(),
                    from,
                    to: *centre,
                    traces: own.len() as f64,
                });
            }
        }
    }
    routes
}

/// The mean over rows, where there are any.
pub(super) fn mean(rows: &[usize], value: impl Fn(usize) -> f64) -> Option<f64> {
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
