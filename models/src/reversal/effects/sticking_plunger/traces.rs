//! The traces of one indicator, and the hold and the paths by which its pointer went through them.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DVector;
use rayon::prelude::*;

use super::super::Linearised;
use super::followed::{COST, Path, follow, mean_lag, threshold};
use super::track::{Hold, Track, Way};
use crate::model::FittedModel;

/// Holds that a first search goes through, as parts of the one that the mean tells, and those of a later one.
const FIRST: [f64; 11] = [0.35, 0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0];
const LATER: [f64; 5] = [0.85, 0.93, 1.0, 1.07, 1.15];

/// Follows the pointer of an indicator from a hold, which it finds anew; none of its traces where, beside another
/// indicator, its mean says as much. `is_known`: whether the hold is from a search before.
pub(super) fn followed_by(
    model: &Linearised,
    readings: &DVector<f64>,
    hold: &mut Hold,
    is_known: bool,
    beside_others: bool,
) -> Option<Vec<Way>> {
    let traces = traces_of(model, hold.indicator);
    let mut traces: Vec<Followed> = traces
        .map(|(number, rows)| Followed::new(model, readings, number, &rows))
        .collect();
    let parts: &[f64] = if is_known { &LATER } else { &FIRST };
    let (size, best) = likeliest(&traces, hold.size, parts)?;
    if beside_others {
        // Of a greater hold more of the path itself would be taken for its mean.
        let sizes = parts.iter().filter(|part| **part <= 1.0);
        let means = sizes.map(|part| part * hold.size);
        let means = means.map(|size| (size, unfollowed(&traces, size)));
        let (mean, cost) = means.min_by(|a, b| a.1.total_cmp(&b.1))?;
        if best.cost > cost {
            (hold.size, hold.std) = (mean, 0.0);
            return Some(Vec::new());
        }
    }
    shown_again(&mut traces, &best.paths, model.positions());
    let (size, best) = likeliest(&traces, size, &LATER)?;
    let seen = traces.iter().map(|trace| &trace.seen[..]);
    (hold.size, hold.std) = threshold(seen.zip(&best.paths), size);
    let ways = traces.iter().zip(best.paths).map(|(trace, path)| Way {
        trace: trace.number,
        indicator: hold.indicator,
        path,
    });
    Some(ways.collect())
}

/// What the pointer of a channel shows of the positions.
pub(super) struct Shown {
    pub traces: Vec<Range<usize>>,
    /// By position: the readings that show what is seen there.
    pub readings: Vec<Vec<usize>>,
}

impl Shown {
    pub fn of(model: &Linearised, track: &Track, channel: usize) -> Self {
        let n = model.positions().len();
        let mut shown = Self {
            traces: Vec::new(),
            readings: vec![Vec::new(); n],
        };
        for way in &track.ways {
            // A track of another measurement has traces that this one has not.
            let own = model.traces().get(way.trace).filter(|t| t.len() == n);
            let Some((trace, place)) = own.map(|trace| (trace, &model.places()[trace.start]))
            else {
                continue;
            };
            if place.channel != channel {
                continue;
            }
            let forward = place.direction > 0.0;
            let at = |k: usize| if forward { k } else { n - 1 - k };
            for (from, until) in way.path.stands(n).filter(|(from, _)| *from < n) {
                let rows = (from..until.min(n)).map(|k| trace.start + at(k));
                shown.readings[at(from)].extend(rows);
            }
            shown.traces.push(trace.clone());
        }
        shown
    }
}

/// Values at all positions from those that are known: straight lines between them, and as at the first and the last
/// beyond.
pub(super) fn between(known: &[Option<f64>], positions: &[f64]) -> Vec<f64> {
    let nodes = positions.iter().zip(known);
    let nodes: Vec<(f64, f64)> = nodes.filter_map(|(x, v)| Some((*x, (*v)?))).collect();
    let at = |x: &f64| {
        let after = nodes.partition_point(|node| node.0 < *x);
        match (
            after.checked_sub(1).and_then(|k| nodes.get(k)),
            nodes.get(after),
        ) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
            (Some(only), None) | (None, Some(only)) => only.1,
            (None, None) => 0.0,
        }
    };
    positions.iter().map(at).collect()
}

/// A trace in the order of time: what the stylus sees and what the pointer shows.
struct Followed {
    number: usize,
    channel: usize,
    /// Indices of the positions.
    positions: Vec<usize>,
    seen: Vec<f64>,
    shown: Vec<f64>,
}

impl Followed {
    fn new(model: &Linearised, readings: &DVector<f64>, number: usize, rows: &[usize]) -> Self {
        let trace = &model.traces()[number];
        let seen = |k: &usize| model.smooth_reading(*k);
        // The change of the reading that is looked for, whatever else lies beneath it.
        let shown = |k: &usize| seen(k) + readings[*k] - model.cell_reading(*k);
        Self {
            number,
            channel: model.places()[trace.start].channel,
            positions: rows.iter().map(|k| k - trace.start).collect(),
            seen: rows.iter().map(seen).collect(),
            shown: rows.iter().map(shown).collect(),
        }
    }
}

/// What the stylus sees by what the pointers show of it: a plunger that sticks bends what is taken for it.
fn shown_again(traces: &mut [Followed], paths: &[Path], positions: &[f64]) {
    let n = positions.len();
    let mut off: BTreeMap<usize, Vec<(f64, usize)>> = BTreeMap::new();
    for (trace, path) in traces.iter().zip(paths) {
        let own = off
            .entry(trace.channel)
            .or_insert_with(|| vec![(0.0, 0); n]);
        for (from, until) in path.stands(trace.seen.len()) {
            let (sum, count) = &mut own[trace.positions[from]];
            let shown = trace.shown[from..until].iter();
            *sum += shown.map(|shown| shown - trace.seen[from]).sum::<f64>();
            *count += until - from;
        }
    }
    let mean = |(sum, count): &(f64, usize)| (*count > 0).then(|| sum / *count as f64);
    for (channel, own) in off {
        let own: Vec<Option<f64>> = own.iter().map(mean).collect();
        let off = between(&own, positions);
        for trace in traces.iter_mut().filter(|trace| trace.channel == channel) {
            let seen = trace.seen.iter_mut().zip(&trace.positions);
            seen.for_each(|(seen, k)| *seen += off[*k]);
        }
    }
}

/// The paths of a pointer in its traces, and twice their negative logarithm of the likelihood.
struct Paths {
    cost: f64,
    paths: Vec<Path>,
}

/// The same where no trace is followed and the mean is taken, of what size it may be.
fn unfollowed(traces: &[Followed], hold: f64) -> f64 {
    let (mut square, mut along, mut own, mut count) = (0.0, 0.0, 0.0, 0);
    for trace in traces {
        let lag = mean_lag(&trace.seen, hold);
        for ((stylus, said), lag) in trace.seen.iter().zip(&trace.shown).zip(&lag) {
            square += (said - stylus).powi(2);
            along += (said - stylus) * lag;
            own += lag * lag;
        }
        count += lag.len();
    }
    let left = square - along.max(0.0).powi(2) / own.max(f64::MIN_POSITIVE);
    let variance = (left / count.max(1) as f64).max(f64::MIN_POSITIVE);
    count as f64 * variance.ln()
}

/// The likeliest of some holds, parts of one, and the paths at it.
fn likeliest(traces: &[Followed], hold: f64, parts: &[f64]) -> Option<(f64, Paths)> {
    let freely = of_traces(traces, hold, 0.0)?;
    let noise = variance(traces, &freely);
    let tried = parts.par_iter().map(|part| {
        let size = part * hold;
        Some((size, paths(traces, size, noise)?))
    });
    let tried: Vec<Option<(f64, Paths)>> = tried.collect();
    let tried = tried.into_iter().flatten();
    tried.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
}

/// The likeliest paths at a hold, where choices cost what they do at a variance of the readings.
fn paths(traces: &[Followed], hold: f64, noise: f64) -> Option<Paths> {
    let paths = of_traces(traces, hold, noise)?;
    let choices: usize = paths.iter().map(|path| path.choices).sum();
    let count: usize = traces.iter().map(|trace| trace.seen.len()).sum();
    Some(Paths {
        cost: count as f64 * variance(traces, &paths).ln() + COST * choices as f64,
        paths,
    })
}

fn of_traces(traces: &[Followed], hold: f64, noise: f64) -> Option<Vec<Path>> {
    let own = traces.iter();
    own.map(|trace| follow(&trace.seen, &trace.shown, hold, noise))
        .collect()
}

/// What paths leave.
fn variance(traces: &[Followed], paths: &[Path]) -> f64 {
    let count: usize = traces.iter().map(|trace| trace.seen.len()).sum();
    let square: f64 = paths.iter().map(|path| path.square).sum();
    (square / count.max(1) as f64).max(f64::MIN_POSITIVE)
}

/// The traces of an indicator by their number, each with its readings in the order of time.
pub(super) fn traces_of(
    model: &Linearised,
    indicator: usize,
) -> impl Iterator<Item = (usize, Vec<usize>)> {
    let places = model.places();
    let traces = model.traces().iter().enumerate();
    let own = traces.filter(move |(_, trace)| {
        !trace.is_empty() && model.seat(&places[trace.start]).indicator == indicator
    });
    own.map(move |(number, trace)| {
        let forward = places[trace.start].direction > 0.0;
        let rows: Vec<usize> = if forward {
            trace.clone().collect()
        } else {
            trace.clone().rev().collect()
        };
        (number, rows)
    })
}
