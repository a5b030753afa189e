//! Readings of a channel without what its traces differ by in height, or in height and slope.
//!
//! An indicator that is zeroed before each trace, a lost motion between the directions, and a drift along a trace shift
//! and tilt whole traces. That is no detail of a form, yet beside it a criterion takes detail for noise; and a mean over
//! repeats of which one ends before the others has a step.

use std::borrow::Cow;

use super::survey::Survey;
use super::traces::{self, CellTrace, Group};

/// Passes over the traces; where all have readings in all cells the second changes nothing.
const PASSES: usize = 20;
/// Change of a height, relative to the greatest, at which the passes end.
const SETTLED: f64 = 1e-6;
/// Cells that a trace must share with others, and as part of its own.
const FEWEST_CELLS: usize = 3;
const SHARED: f64 = 0.5;

/// Variance of the heights of repeats, in that of the mean of independent readings, from which on they stand apart.
const APART: f64 = 9.0;

/// Readings brought to one height.
pub struct Levelled {
    /// By channel, µm.
    pub values: Vec<Vec<f64>>,
    /// How many heights were found, less one for each mean, by channel.
    pub heights: Vec<usize>,
    /// The greatest height taken out, µm.
    pub greatest: f64,
    /// Whether repeats stand apart that were not read at the same positions: elsewhere heights change a mean over repeats by a
    /// constant. Or whether these are the heights of both passes.
    pub matters: bool,
    /// Whether these are the heights of both passes, where nothing is repeated.
    pub by_pass: bool,
}

impl Levelled {
    /// How many numbers of a channel were taken out that no repeats account for.
    pub fn taken_out(&self, channel: usize) -> usize {
        match self.by_pass {
            true => self.heights[channel],
            false => 0,
        }
    }
}

/// Height, µm, and slope, µm per half the channel's travel, of what a trace lies above the others.
pub(super) type Line = [f64; 2];

impl Survey<'_> {
    /// The readings of every channel, µm, less the lines by which its traces differ; the mean of these lines is left.
    /// `None` where no channel has more than one trace.
    pub fn alike(&self) -> Option<Vec<Vec<f64>>> {
        self.traces
            .iter()
            .any(|own| several(own))
            .then(|| self.without_lines(&self.values))
    }

    /// Values of the readings of every channel less the lines by which its traces differ, as [`alike`](Self::alike).
    pub fn without_lines<V: AsRef<[f64]>>(&self, values: &[V]) -> Vec<Vec<f64>> {
        let all = self.traces.iter().zip(values).enumerate();
        all.map(|(c, (own, values))| match several(own) {
            true => self.channel_alike(c, values.as_ref()),
            false => values.as_ref().to_vec(),
        })
        .collect()
    }

    /// The readings of every channel less the heights by which the repeats of one direction differ, or all passes where these
    /// are zeroed anew; their mean is left. `None` where there is neither.
    pub fn levelled(&self) -> Option<Levelled> {
        let zeroed = self.passes_are_zeroed();
        let both = || traces::groups_of_channels(&self.x, &self.traces);
        let groups = match zeroed {
            true => Cow::Owned(both()),
            false => Cow::Borrowed(&self.repeats[..]),
        };
        if groups.is_empty() {
            return None;
        }
        let mut level = Levelled {
            values: self.values.iter().map(|v| v.to_vec()).collect(),
            heights: vec![0; self.values.len()],
            greatest: 0.0,
            matters: zeroed,
            by_pass: zeroed,
        };
        for group in groups.iter() {
            let traces = &self.traces[group.channel];
            let own = &mut level.values[group.channel];
            let means = group.means(traces, self.x[group.channel], own);
            let found = lines(group, None, &means);
            level.heights[group.channel] += found.iter().flatten().count().saturating_sub(1);
            let apart = stand_apart(&means, &found);
            level.matters |= apart && !group.is_on_one_grid(traces, self.x[group.channel]);
            for (t, line) in group.traces.iter().zip(found) {
                let height = line.map_or(0.0, |l| l[0]);
                level.greatest = level.greatest.max(height.abs());
                for k in 0..traces[*t].len() {
                    own[traces[*t].row(k)] -= height;
                }
            }
        }
        Some(level)
    }

    fn channel_alike(&self, channel: usize, values: &[f64]) -> Vec<f64> {
        let (x, traces) = (self.x[channel], &self.traces[channel]);
        let mut values = values.to_vec();
        let group = traces::of_channel(channel, x, traces);
        let (Some(first), Some(last)) = (x.first(), x.last()) else {
            return values;
        };
        let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
        let along = |x: f64| if half > 0.0 { (x - middle) / half } else { 0.0 };
        let xi: Vec<f64> = group.positions.iter().map(|x| along(*x)).collect();
        let lines = lines(&group, Some(&xi), &group.means(traces, x, &values));
        for (t, line) in group.traces.iter().zip(lines) {
            let line = line.unwrap_or_default();
            for k in 0..traces[*t].len() {
                let row = traces[*t].row(k);
                values[row] -= line[0] + line[1] * along(x[row]);
            }
        }
        values
    }
}

/// Whether a channel has more than one trace.
fn several(traces: &[traces::Trace]) -> bool {
    traces.iter().filter(|t| t.len() > 0).count() > 1
}

impl Group {
    /// Whether all traces have the same positions.
    fn is_on_one_grid(&self, traces: &[traces::Trace], x: &[f64]) -> bool {
        let Some(first) = self.traces.first().map(|t| &traces[*t]) else {
            return true;
        };
        self.traces.iter().map(|t| &traces[*t]).all(|own| {
            own.len() == first.len() && (0..own.len()).all(|k| x[own.row(k)] == x[first.row(k)])
        })
    }

    /// By trace the cells with the mean of its readings, less the slope that the traces have in common: where traces have
    /// positions of their own, their readings of a cell lie apart along it.
    pub(super) fn means(
        &self,
        traces: &[traces::Trace],
        x: &[f64],
        values: &[f64],
    ) -> Vec<Vec<(usize, f64)>> {
        let slope = common_slope(traces, x, values);
        let of = |(t, own): (&usize, &CellTrace)| {
            let level = |k: usize| {
                let row = traces[*t].row(k);
                values[row] - slope * x[row]
            };
            let mean = |(cell, range): &(usize, std::ops::Range<usize>)| {
                let sum: f64 = range.clone().map(level).sum();
                (*cell, sum / range.len() as f64)
            };
            own.cells.iter().map(mean).collect()
        };
        self.traces.iter().zip(&self.on_cells).map(of).collect()
    }
}

/// The least-squares slope of traces each about a mean of its own, µm/mm.
fn common_slope(traces: &[traces::Trace], x: &[f64], values: &[f64]) -> f64 {
    let (mut product, mut spread) = (0.0, 0.0);
    for trace in traces.iter().filter(|t| t.len() > 0) {
        let rows = || (0..trace.len()).map(|k| trace.row(k));
        let n = trace.len() as f64;
        let (at, mean) = rows().fold((0.0, 0.0), |(at, mean), row| {
            (at + x[row] / n, mean + values[row] / n)
        });
        for row in rows() {
            product += (x[row] - at) * (values[row] - mean);
            spread += (x[row] - at) * (x[row] - at);
        }
    }
    if spread > 0.0 { product / spread } else { 0.0 }
}

/// By how much each trace lies above what all have in common, found in turns with it; slopes where the cells have a place ξ.
/// `None` for a trace that shares too few of its cells with others.
pub(super) fn lines(
    group: &Group,
    xi: Option<&[f64]>,
    means: &[Vec<(usize, f64)>],
) -> Vec<Option<Line>> {
    let mut count = vec![0.0; group.positions.len()];
    for (cell, _) in means.iter().flatten() {
        count[*cell] += 1.0;
    }
    let shared = |own: &Vec<(usize, f64)>| {
        let shared: Vec<_> = own.iter().copied().filter(|m| count[m.0] > 1.0).collect();
        let enough =
            shared.len() >= FEWEST_CELLS && shared.len() as f64 >= SHARED * own.len() as f64;
        enough.then_some(shared)
    };
    let shared: Vec<Option<Vec<(usize, f64)>>> = means.iter().map(shared).collect();
    let mut of_cell = vec![0.0; count.len()];
    for (cell, _) in shared.iter().flatten().flatten() {
        of_cell[*cell] += 1.0;
    }
    let xi_of = |cell: usize| xi.map_or(0.0, |xi| xi[cell]);
    let mut lines: Vec<Option<Line>> = shared
        .iter()
        .map(|s| s.as_ref().map(|_| [0.0; 2]))
        .collect();
    for _ in 0..PASSES {
        let mut common = vec![0.0; count.len()];
        for (own, line) in shared.iter().flatten().zip(lines.iter().flatten()) {
            for (cell, mean) in own {
                common[*cell] += (mean - line[0] - line[1] * xi_of(*cell)) / of_cell[*cell];
            }
        }
        let mut next: Vec<Line> = shared
            .iter()
            .flatten()
            .map(|own| {
                let above = own
                    .iter()
                    .map(|(cell, mean)| (xi_of(*cell), mean - common[*cell]));
                fitted(&above.collect::<Vec<_>>())
            })
            .collect();
        let n = next.len() as f64;
        let mean = [0, 1].map(|j| next.iter().map(|l| l[j]).sum::<f64>() / n);
        let (mut moved, mut greatest) = (0.0_f64, 0.0_f64);
        for (line, before) in next.iter_mut().zip(lines.iter_mut().flatten()) {
            for j in 0..2 {
                line[j] -= mean[j];
                moved = moved.max((line[j] - before[j]).abs());
                greatest = greatest.max(line[j].abs());
            }
            *before = *line;
        }
        if moved <= SETTLED * greatest {
            break;
        }
    }
    lines
}

/// Whether heights differ by more than readings independent of each other would let them.
fn stand_apart(means: &[Vec<(usize, f64)>], heights: &[Option<Line>]) -> bool {
    let cells = 1 + means.iter().flatten().map(|m| m.0).max().unwrap_or(0);
    let level = || {
        let pairs = means.iter().zip(heights);
        pairs.filter_map(|(own, line)| line.map(|l| (own, l[0])))
    };
    let (mut sum, mut count) = (vec![0.0; cells], vec![0.0; cells]);
    for (own, height) in level() {
        for (cell, mean) in own {
            sum[*cell] += mean - height;
            count[*cell] += 1.0;
        }
    }
    let (mut squares, mut freedom, mut above) = (0.0, 0.0, 0.0);
    for (own, height) in level() {
        for (cell, mean) in own {
            squares += (mean - height - sum[*cell] / count[*cell]).powi(2);
        }
        freedom += own.len() as f64;
        above += own.len() as f64 * height * height;
    }
    let traces = level().count() as f64;
    freedom -= count.iter().filter(|c| **c > 0.0).count() as f64 + traces - 1.0;
    freedom > 0.0 && above * freedom > APART * (traces - 1.0) * squares
}

/// The least-squares line; the mean where all places are one.
fn fitted(points: &[(f64, f64)]) -> Line {
    let n = points.len() as f64;
    let x = points.iter().map(|p| p.0).sum::<f64>() / n;
    let y = points.iter().map(|p| p.1).sum::<f64>() / n;
    let (mut product, mut spread) = (0.0, 0.0);
    for p in points {
        product += (p.0 - x) * (p.1 - y);
        spread += (p.0 - x) * (p.0 - x);
    }
    let slope = if spread > 0.0 { product / spread } else { 0.0 };
    [y - slope * x, slope]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reversal::simultaneous::ChannelReadings;
    use crate::reversal::{Channel, Direction, Observations, Reading};

    #[test]
    fn zeros_and_drifts_of_traces_are_taken_out_and_nothing_else() {
        let form = |x: f64| 3.0 * (x / 40.0).sin();
        let above = |repeat: u32, back: bool, x: f64| {
            let zero = 5.0 * f64::from(repeat * repeat) - 2.0 * f64::from(u8::from(back));
            zero + 0.01 * f64::from(repeat) * x
        };
        let mut readings = Vec::new();
        for repeat in 1..=3 {
            for direction in [Direction::Forward, Direction::Backward] {
                for k in 0..50 {
                    // Every trace lacks a reading of its own.
                    if k == 7 + 5 * repeat {
                        continue;
                    }
                    let x = 6.0 * f64::from(k);
                    let back = direction == Direction::Backward;
                    readings.push(Reading {
                        channel: Channel::C1A,
                        repeat,
                        direction,
                        time: None,
                        x,
                        value: form(x) + above(repeat, back, x),
                    });
                }
            }
        }
        let data = Observations { readings };
        let channels = ChannelReadings::sort(&data);
        let survey = Survey::new(&channels, |i| data.taken(i));
        let alike = survey.alike().unwrap();
        // The mean line is left.
        let mean = |x: f64| (1..=3).map(|r| above(r, false, x) - 1.0).sum::<f64>() / 3.0;
        for (x, value) in channels[0].x.iter().zip(&alike[0]) {
            // Epsilon: traces share 44 of 50 cells; the passes end at a millionth of 40 µm.
            assert!((value - form(*x) - mean(*x)).abs() < 1e-3, "{x}: {value}");
        }
    }

    /// Repeats on grids of their own, up a slope: what lies between their readings is no height.
    #[test]
    fn grids_that_are_shifted_have_no_heights() {
        let mut readings = Vec::new();
        for repeat in 1..=3 {
            for k in 0..50 {
                let x = 6.0 * f64::from(k) + 1.5 * f64::from(repeat);
                readings.push(Reading {
                    channel: Channel::C1A,
                    repeat,
                    direction: Direction::Forward,
                    time: None,
                    x,
                    value: 0.9 * x + (x / 40.0).sin(),
                });
            }
        }
        let data = Observations { readings };
        let channels = ChannelReadings::sort(&data);
        let survey = Survey::new(&channels, |i| data.taken(i));
        let level = survey.levelled().unwrap();
        // Truncation: 1.35 µm lie between neighbouring grids along the slope; what is left is the wave's, whose slope has no
        // mean over the travel but for 0.003 µm/mm.
        assert!(level.greatest < 0.02, "{}", level.greatest);
        assert!(!level.matters);
    }
}
