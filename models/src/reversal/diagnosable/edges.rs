//! The cells that readings are gathered into: of what travel, and where their edges lie.

use std::collections::{BTreeMap, BTreeSet};

use super::filling;
use super::gathering::{Traces, most_cells};
use super::sorting::{TraceKey, position_key};
use crate::reversal::designs::DesignReading;
use crate::reversal::straight_line;

/// Leaves out traces so short that the others together lose more readings by them than they bring;
/// of every channel the longest stays.
pub(super) fn drop_short(traces: &mut Traces, readings: &[DesignReading]) {
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

/// Over how much the first positions of the traces spread, and the last, mm.
pub(super) fn spread_of_ends(traces: &Traces, readings: &[DesignReading]) -> [f64; 2] {
    let ends = traces.values().filter_map(|rows| {
        let (first, last) = rows.first().zip(rows.last())?;
        Some([first, last].map(|k| readings[*k].x))
    });
    straight_line::spread_of_ends(ends)
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
pub(super) fn edges_of_all(traces: &Traces, readings: &[DesignReading]) -> Option<Vec<f64>> {
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
pub(super) fn edges_to_fill(traces: &Traces, readings: &[DesignReading]) -> Option<Vec<f64>> {
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
pub(super) fn by_cell<'a>(
    rows: &'a [usize],
    readings: &[DesignReading],
    edges: &[f64],
) -> Vec<&'a [usize]> {
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
