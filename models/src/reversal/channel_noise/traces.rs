//! Which of a channel's sorted readings were taken in one go: a trace is a channel, a repeat and a
//! direction.

use std::collections::BTreeMap;

use super::SortedReadings;
use crate::reversal::Direction;

/// Cells along a trace; more would tell no more of what is correlated along it.
pub const MOST_CELLS: usize = 400;
/// Positions of repeats that differ by no more than this share of them count as the same, with
/// readings left out.
const LEFT_OUT: f64 = 0.1;

/// One trace: the places of its readings among its channel's sorted readings.
#[derive(Debug, Clone)]
pub struct Trace {
    /// Whether the slide moved backward.
    pub backward: bool,
    /// The number of its repeat.
    pub repeat: u32,
    /// Its readings; all of the channel's where `None`.
    rows: Option<Vec<u32>>,
    count: usize,
}

impl Trace {
    /// Number of readings.
    pub fn len(&self) -> usize {
        self.count
    }

    /// The place of a reading among its channel's.
    pub fn row(&self, k: usize) -> usize {
        self.rows.as_ref().map_or(k, |rows| rows[k] as usize)
    }
}

/// The traces of every channel; `taken` tells how one of the observations was taken.
pub fn of<C: SortedReadings>(
    channels: &[C],
    taken: impl Fn(usize) -> (Direction, u32),
) -> Vec<Vec<Trace>> {
    channels
        .iter()
        .map(|channel| {
            let count = channel.x().len();
            let key = |row: usize| {
                let (direction, repeat) = taken(channel.source(row));
                (direction == Direction::Backward, repeat)
            };
            let first = (count > 0).then(|| key(0));
            if (0..count).all(|row| Some(key(row)) == first) {
                return vec![Trace {
                    backward: first.is_some_and(|f| f.0),
                    repeat: first.map_or(0, |f| f.1),
                    rows: None,
                    count,
                }];
            }
            let mut traces: BTreeMap<(bool, u32), Vec<u32>> = BTreeMap::new();
            for (row, at) in (0..count).zip(0_u32..) {
                traces.entry(key(row)).or_default().push(at);
            }
            traces
                .into_iter()
                .map(|((backward, repeat), rows)| Trace {
                    backward,
                    repeat,
                    count: rows.len(),
                    rows: Some(rows),
                })
                .collect()
        })
        .collect()
}

/// The readings of one trace gathered on the cells of its group.
#[derive(Debug, Clone)]
pub struct CellTrace {
    /// By cell that has a reading: the cell, and the places of its readings in the trace.
    pub cells: Vec<(usize, std::ops::Range<usize>)>,
}

/// The repeats of a channel in one direction, on common cells.
#[derive(Debug, Clone)]
pub struct Group {
    /// The channel's place among those that were read.
    pub channel: usize,
    /// The traces' places among the channel's.
    pub traces: Vec<usize>,
    /// Mean position of the readings of each cell, mm.
    pub positions: Vec<f64>,
    /// Each trace on the cells.
    pub on_cells: Vec<CellTrace>,
}

impl Group {
    /// The cells in which every repeat has a reading.
    pub fn complete(&self) -> Vec<usize> {
        let mut count = vec![0; self.positions.len()];
        for trace in &self.on_cells {
            for (cell, _) in &trace.cells {
                count[*cell] += 1;
            }
        }
        let all = self.traces.len();
        (0..count.len()).filter(|k| count[*k] == all).collect()
    }
}

/// Groups of repeats, on cells: a position each where repeats share their positions, so that nothing is
/// averaged; otherwise stretches of about two readings or more, so that differing positions meet.
pub fn grouped(x: &[&[f64]], traces: &[Vec<Trace>]) -> Vec<Group> {
    let channels = x.iter().zip(traces).enumerate();
    channels
        .flat_map(|(c, (x, traces))| of_directions(c, x, traces))
        .collect()
}

/// The groups of one channel: of either direction in which it was read.
pub fn of_directions(channel: usize, x: &[f64], traces: &[Trace]) -> Vec<Group> {
    let groups = [false, true]
        .map(|backward| Some(group(channel, x, traces, in_direction(traces, backward)?)));
    groups.into_iter().flatten().collect()
}

/// All traces of a channel, in whatever direction, on common cells.
pub fn of_channel(channel: usize, x: &[f64], traces: &[Trace]) -> Group {
    let own = (0..traces.len()).filter(|t| traces[*t].len() > 0);
    group(channel, x, traces, own.collect())
}

/// All traces of each channel that was read, in whatever direction, on common cells.
pub fn groups_of_channels(x: &[&[f64]], traces: &[Vec<Trace>]) -> Vec<Group> {
    let read = |c: &usize| traces[*c].iter().any(|t| t.len() > 0);
    let all = (0..x.len()).filter(read);
    all.map(|c| of_channel(c, x[c], &traces[c])).collect()
}

/// The groups of all channels and directions on cells that all of them share, at positions that they have in common: as many as
/// leave none empty; empty where not so many as `fewest` do.
pub fn on_shared_cells(x: &[&[f64]], traces: &[Vec<Trace>], fewest: usize) -> Vec<Group> {
    let ends = x.iter().filter_map(|x| Some((*x.first()?, *x.last()?)));
    let (low, high) = ends.fold((f64::NEG_INFINITY, f64::INFINITY), |(l, h), (a, b)| {
        (l.max(a), h.min(b))
    });
    let lengths = traces.iter().flatten().map(Trace::len);
    let shortest = lengths.filter(|n| *n > 0).min().unwrap_or(0);
    let mut count = (shortest / 2).min(MOST_CELLS);
    while count >= fewest.max(1) && low < high {
        let edges = even_edges([low, high], count);
        let of_channel = |(c, (x, traces)): (usize, (&&[f64], &Vec<Trace>))| {
            [false, true].map(|backward| {
                let own = in_direction(traces, backward)?;
                Some(on_edges(c, x, traces, own, &edges))
            })
        };
        let channels = x.iter().zip(traces).enumerate();
        let found = channels.flat_map(of_channel).flatten();
        let mut groups: Vec<Group> = found.collect();
        let filled = |group: &Group| group.on_cells.iter().all(|t| t.cells.len() == count);
        if groups.iter().all(filled) {
            let mean = |k: usize| {
                let sum: f64 = groups.iter().map(|g| g.positions[k]).sum();
                sum / groups.len() as f64
            };
            let positions: Vec<f64> = (0..count).map(mean).collect();
            for group in &mut groups {
                group.positions.clone_from(&positions);
            }
            return groups;
        }
        count = count * 3 / 4;
    }
    Vec::new()
}

/// The traces of a channel in one direction, if there are any.
fn in_direction(traces: &[Trace], backward: bool) -> Option<Vec<usize>> {
    let own: Vec<usize> = (0..traces.len())
        .filter(|t| traces[*t].backward == backward && traces[*t].len() > 0)
        .collect();
    (!own.is_empty()).then_some(own)
}

fn group(c: usize, x: &[f64], traces: &[Trace], own: Vec<usize>) -> Group {
    let longest = own.iter().map(|t| traces[*t].len()).max().unwrap_or(0);
    let positions = |t: &usize| {
        let trace = &traces[*t];
        (0..trace.len()).map(|k| x[trace.row(k)])
    };
    let edges =
        shared_positions(longest, own.iter().flat_map(positions)).unwrap_or_else(|| {
            match (x.first(), x.last()) {
                (Some(first), Some(last)) => {
                    even_edges([*first, *last], (longest / 2).clamp(1, MOST_CELLS))
                }
                _ => Vec::new(),
            }
        });
    on_edges(c, x, traces, own, &edges)
}

/// Traces on cells with these left ends.
fn on_edges(c: usize, x: &[f64], traces: &[Trace], own: Vec<usize>, edges: &[f64]) -> Group {
    let x_of = |t: usize| (0..traces[t].len()).map(move |k| x[traces[t].row(k)]);
    // The last edge at or below a position; positions grow along a trace.
    let cell_of = |x: f64, before: usize| {
        let beyond = edges[before..].iter().skip(1).position(|e| *e > x);
        beyond.map_or(edges.len().saturating_sub(1), |more| before + more)
    };
    let mut sums = vec![(0.0, 0.0); edges.len()];
    let on_cells: Vec<CellTrace> = own
        .iter()
        .map(|t| {
            let most = edges.len().min(traces[*t].len());
            let mut cells: Vec<(usize, std::ops::Range<usize>)> = Vec::with_capacity(most);
            let mut cell = 0;
            for (k, x) in x_of(*t).enumerate() {
                cell = cell_of(x, cell);
                sums[cell].0 += x;
                sums[cell].1 += 1.0;
                match cells.last_mut() {
                    Some((at, range)) if *at == cell => range.end = k + 1,
                    _ => cells.push((cell, k..k + 1)),
                }
            }
            CellTrace { cells }
        })
        .collect();
    let positions = sums
        .iter()
        .zip(edges)
        .map(|((sum, count), edge)| if *count > 0.0 { sum / count } else { *edge })
        .collect();
    Group {
        channel: c,
        traces: own,
        positions,
        on_cells,
    }
}

/// The positions of all repeats, where these share them.
fn shared_positions(longest: usize, x: impl Iterator<Item = f64>) -> Option<Vec<f64>> {
    if longest > MOST_CELLS {
        return None;
    }
    let mut all: Vec<f64> = x.collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    (all.len() as f64 <= (1.0 + LEFT_OUT) * longest as f64).then_some(all)
}

/// Left ends of so many even cells.
fn even_edges([first, last]: [f64; 2], count: usize) -> Vec<f64> {
    let width = (last - first) / count as f64;
    (0..count).map(|k| first + k as f64 * width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reversal::simultaneous::ChannelReadings;
    use crate::reversal::{Channel, Observations, Reading};

    fn traces_of(channels: &[ChannelReadings], data: &Observations) -> Vec<Vec<Trace>> {
        of(channels, |i| {
            (data.readings[i].direction, data.readings[i].repeat)
        })
    }

    fn groups_of(channels: &[ChannelReadings], traces: &[Vec<Trace>]) -> Vec<Group> {
        let x: Vec<&[f64]> = channels.iter().map(|c| c.x.as_slice()).collect();
        grouped(&x, traces)
    }

    fn observations(x: impl Fn(u32, usize) -> f64, repeats: u32, n: usize) -> Observations {
        let readings = (1..=repeats)
            .flat_map(|repeat| (0..n).map(move |k| (repeat, k)))
            .map(|(repeat, k)| Reading {
                channel: Channel::C1A,
                repeat,
                direction: Direction::Forward,
                time: None,
                x: x(repeat, k),
                value: f64::from(repeat),
            })
            .collect();
        Observations { readings }
    }

    #[test]
    fn shared_positions_are_cells_of_their_own() {
        let data = observations(|_, k| 2.0 * k as f64, 3, 10);
        let channels = ChannelReadings::sort(&data);
        let traces = traces_of(&channels, &data);
        assert_eq!(
            traces[0].iter().map(Trace::len).collect::<Vec<_>>(),
            [10; 3]
        );
        let groups = groups_of(&channels, &traces);
        assert_eq!(groups.len(), 1);
        assert_eq!(groups[0].positions.len(), 10);
        assert_eq!(groups[0].complete().len(), 10);
        // Every reading of a trace is its own repeat's.
        for (place, trace) in traces[0].iter().enumerate() {
            for k in 0..10 {
                assert_eq!(channels[0].value[trace.row(k)], 1.0 + place as f64);
            }
        }
    }

    #[test]
    fn positions_that_differ_meet_in_wider_cells() {
        let data = observations(|r, k| 2.0 * k as f64 + 0.3 * f64::from(r), 3, 40);
        let channels = ChannelReadings::sort(&data);
        let groups = groups_of(&channels, &traces_of(&channels, &data));
        assert_eq!(groups[0].positions.len(), 20);
        assert!(groups[0].complete().len() >= 18, "{groups:?}");
        let of_trace = |t: &CellTrace| t.cells.iter().map(|c| c.1.len()).sum::<usize>();
        assert!(groups[0].on_cells.iter().all(|t| of_trace(t) == 40));
    }

    #[test]
    fn one_trace_is_the_channel() {
        let data = observations(|_, k| k as f64, 1, 900);
        let channels = ChannelReadings::sort(&data);
        let traces = traces_of(&channels, &data);
        assert_eq!((traces[0].len(), traces[0][0].row(17)), (1, 17));
        assert_eq!(groups_of(&channels, &traces)[0].positions.len(), MOST_CELLS);
    }
}
