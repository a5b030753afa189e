//! The plunger of an indicator sticks: the pointer stays where it is until the stylus is off by the hold, and
//! then goes all the way to it.
//!
//! What is seen of it is a sawtooth of the reading, which begins in every trace where the plunger stood. Friction
//! is not the same each time: it lets go between [`LOOSE`] less and more than the hold, and where it did is
//! told by the readings themselves (`followed.rs`). It is found by its mean over where the plunger may have
//! stood, a lag behind the direction in which the reading changes, and followed from there. Free: a hold for each
//! indicator, where the plunger stands when a trace begins, when it lets go.

mod followed;
mod track;

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::indicators::{ALL, Indicators};
use super::{Linearised, spread};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Shape};
use followed::{Path, follow, mean_lag, threshold};
use track::{Hold, Track, Way};

/// See the head of the file. Variants: the indicators.
pub(super) struct StickingPlunger(pub Indicators);

/// Part of the hold by which it lets go sooner or later.
const LOOSE: f64 = 0.3;
/// Holds that a first search goes through, as parts of the one that the mean tells, and those of a later one.
const FIRST: [f64; 11] = [0.35, 0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0];
const LATER: [f64; 5] = [0.85, 0.93, 1.0, 1.07, 1.15];
/// How often what the stylus sees is found by what the pointers show of it.
const ROUNDS: usize = 1;
/// Parts of the span of the readings at which the search begins.
const PARTS: [f64; 6] = [1e-3, 3e-3, 1e-2, 3e-2, 6e-2, 1e-1];

impl Effect<Linearised> for StickingPlunger {
    fn name(&self) -> &str {
        "sticking-plunger"
    }

    fn about(&self) -> About {
        About {
            physics: "the plunger of an indicator sticks: its pointer stays until it is off by the hold and then goes all the way",
            confirm: "tap the indicator lightly and see whether its pointer moves; clean the plunger and repeat",
            source: "stick and slip of a plunger in its bushing; Armstrong-Helouvry, Control of Machines with Friction (1991)",
        }
    }

    fn link(&self) -> Link {
        Link::Pointer
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::variant(ALL))
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let hold = Parameter::between("hold", "um", 0.0, 50.0);
        self.0.sizes(shape.variant, &hold, "hold")
    }

    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let span = model.reading_span();
        let of = |scope: usize| {
            let holds = PARTS.into_iter().map(move |part| part * span);
            holds.map(move |hold| {
                let own = self.0.of(scope);
                let begun = Track::begun(own.map(|indicator| (indicator, hold)));
                begun.written(scope)
            })
        };
        self.0.scopes().flat_map(of).collect()
    }

    /// Others with what is known of the indicators that they have too.
    fn relatives(&self, _model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let Some(track) = Track::read(shape) else {
            return Vec::new();
        };
        let usual = track.holds.first().map_or(0.0, |hold| hold.size);
        let other = |variant: usize| {
            let own = self.0.of(variant);
            track.of_indicators(own, usual).written(variant)
        };
        self.0.others(shape.variant).map(other).collect()
    }

    fn allowed(&self, _model: &Linearised, shape: &Shape) -> bool {
        Track::read(shape).is_some_and(|track| {
            let known = track.holds.iter().map(|hold| hold.indicator);
            known.eq(self.0.of(shape.variant))
        })
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let Some(track) = Track::read(shape) else {
            return Vec::new();
        };
        let of = |hold: &Hold| {
            let mut column = Column::default();
            let size = hold.size.max(1e-9 * model.reading_span());
            for (number, own) in traces_of(model, hold.indicator) {
                let seen: Vec<f64> = own.iter().map(|k| model.smooth_reading(*k)).collect();
                let lag = match track.ways.iter().find(|way| way.trace == number) {
                    Some(way) => way.lag(&seen, size),
                    None => mean_lag(&seen, size),
                };
                column.rows.extend(own);
                column.values.extend(lag.iter().map(|lag| lag / size));
            }
            column
        };
        track.holds.iter().map(of).collect()
    }

    fn traced(&self, model: &Linearised, readings: &DVector<f64>, shape: &Shape) -> Option<Shape> {
        let mut track = Track::read(shape)?;
        let mut ways = Vec::new();
        let beside_others = track.holds.len() > 1;
        for hold in &mut track.holds {
            let own: Vec<Way> = (track.ways.iter())
                .filter(|way| way.indicator == hold.indicator)
                .cloned()
                .collect();
            let traces = traces_of(model, hold.indicator);
            let mut traces: Vec<Followed> = traces
                .map(|(number, rows)| Followed::new(model, readings, number, &rows))
                .collect();
            let parts: &[f64] = if own.is_empty() { &FIRST } else { &LATER };
            let (mut size, mut best) = likeliest(&traces, hold.size, parts)?;
            if beside_others {
                // Of a greater hold more of the path itself would be taken for its mean.
                let sizes = parts.iter().filter(|part| **part <= 1.0);
                let means = sizes.map(|part| part * hold.size);
                let means = means.map(|size| (size, unfollowed(&traces, size)));
                let (mean, cost) = means.min_by(|a, b| a.1.total_cmp(&b.1))?;
                if best.cost > cost {
                    (hold.size, hold.std) = (mean, 0.0);
                    continue;
                }
            }
            for _ in 0..ROUNDS {
                shown_again(&mut traces, &best.paths, model.positions());
                (size, best) = likeliest(&traces, size, &LATER)?;
            }
            let seen = traces.iter().map(|trace| &trace.seen[..]);
            (hold.size, hold.std) = threshold(seen.zip(&best.paths), size);
            ways.extend(traces.iter().zip(best.paths).map(|(trace, path)| Way {
                trace: trace.number,
                indicator: hold.indicator,
                path,
            }));
        }
        track.ways = ways;
        Some(track.written(shape.variant))
    }

    /// While the pointer stands still it shows what was seen where it let go, and nothing of what the stylus has
    /// passed since.
    fn restored(
        &self,
        model: &Linearised,
        shape: &Shape,
        readings: &DVector<f64>,
        clean: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let track = Track::read(shape)?;
        let n = model.positions().len();
        let mut restored = clean.clone();
        for channel in 0..model.present().len() {
            let shown = Shown::of(model, &track, channel);
            let rows = |k: usize| shown.traces.iter().map(move |trace| trace.start + k);
            let off = (0..n).map(|k| {
                let own = &shown.readings[k];
                let seen = own.iter().map(|row| readings[*row]).sum::<f64>() / own.len() as f64;
                let mean = rows(k).map(|row| clean[row]).sum::<f64>() / shown.traces.len() as f64;
                (!own.is_empty()).then_some(seen - mean)
            });
            let off: Vec<Option<f64>> = off.collect();
            for (k, off) in between(&off, model.positions()).into_iter().enumerate() {
                rows(k).for_each(|row| restored[row] += off);
            }
        }
        Some(restored)
    }

    /// What the stylus has passed while the pointer stood still in all traces of a channel is known to the hold.
    fn open(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let Some(track) = Track::read(shape) else {
            return Vec::new();
        };
        let n = model.positions().len();
        let mut columns = Vec::new();
        for channel in 0..model.present().len() {
            let indicator = model.present()[channel].indicator;
            let shown = Shown::of(model, &track, channel);
            let Some(hold) = track.holds.iter().find(|h| h.indicator == indicator) else {
                continue;
            };
            let known: Vec<usize> = (0..n).filter(|k| !shown.readings[*k].is_empty()).collect();
            let (Some(first), Some(last)) = (known.first(), known.last()) else {
                continue;
            };
            let inside = known
                .windows(2)
                .map(|pair| (pair[0] as f64, pair[1] as f64));
            // Beyond the ends it is least known at the end.
            let (first, last, end) = (*first as f64, *last as f64, n as f64 - 1.0);
            let all = inside.chain([(-first, first), (last, 2.0 * end - last)]);
            for (from, to) in all.filter(|(from, to)| to - from > 1.0) {
                let within = (0..n).filter(|k| (from..to).contains(&(*k as f64)));
                let mut column = Column::default();
                for k in within {
                    let part = (k as f64 - from) / (to - from);
                    let arch = 4.0 * part * (1.0 - part);
                    for trace in &shown.traces {
                        column.rows.push(trace.start + k);
                        column.values.push(0.5 * hold.size * arch);
                    }
                }
                columns.push(column);
            }
        }
        columns
    }

    /// Where the plunger stands and when it lets go, by the readings.
    fn choices(&self, shape: &Shape) -> usize {
        Track::read(shape).map_or(0, |track| {
            let own = track.ways.iter().map(|way| way.path.choices);
            own.sum::<usize>() + track.holds.len()
        })
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        Some(self.0.words(shape.variant))
    }

    /// Where traces are followed the hold is told by when it was let go, not by how far.
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let holds = Track::read(shape).map_or_else(Vec::new, |track| track.holds);
        let names = self.amplitudes_at(shape).into_iter().zip(amplitudes);
        let told = names.zip(holds).enumerate();
        told.map(|(k, ((parameter, amplitude), hold))| {
            let (value, std) = if hold.std > 0.0 {
                (hold.size, hold.std)
            } else {
                (*amplitude, spread(covariance, &[(k, 1.0)]))
            };
            Estimate {
                name: parameter.name.into_owned(),
                value,
                std,
                unit: parameter.unit.to_owned(),
            }
        })
        .collect()
    }
}

/// What the pointer of a channel shows of the positions.
struct Shown {
    traces: Vec<Range<usize>>,
    /// By position: the readings that show what is seen there.
    readings: Vec<Vec<usize>>,
}

impl Shown {
    fn of(model: &Linearised, track: &Track, channel: usize) -> Self {
        let n = model.positions().len();
        let mut shown = Self {
            traces: Vec::new(),
            readings: vec![Vec::new(); n],
        };
        for way in &track.ways {
            let trace = &model.traces()[way.trace];
            let place = &model.places()[trace.start];
            if place.channel != channel {
                continue;
            }
            let forward = place.direction > 0.0;
            let at = |k: usize| if forward { k } else { n - 1 - k };
            for (from, until) in way.path.stands(n) {
                let rows = (from..until).map(|k| trace.start + at(k));
                shown.readings[at(from)].extend(rows);
            }
            shown.traces.push(trace.clone());
        }
        shown
    }
}

/// Values at all positions from those that are known: straight lines between them, and as at the first and the last
/// beyond.
fn between(known: &[Option<f64>], positions: &[f64]) -> Vec<f64> {
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
    let sizes = parts.iter().map(|part| part * hold);
    let tried = sizes.filter_map(|size| Some((size, paths(traces, size, noise)?)));
    tried.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
}

/// The likeliest paths at a hold, where choices cost what they do at a variance of the readings.
fn paths(traces: &[Followed], hold: f64, noise: f64) -> Option<Paths> {
    let paths = of_traces(traces, hold, noise)?;
    let choices: usize = paths.iter().map(|path| path.choices).sum();
    let count: usize = traces.iter().map(|trace| trace.seen.len()).sum();
    Some(Paths {
        cost: count as f64 * variance(traces, &paths).ln() + followed::COST * choices as f64,
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
fn traces_of(model: &Linearised, indicator: usize) -> impl Iterator<Item = (usize, Vec<usize>)> {
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
