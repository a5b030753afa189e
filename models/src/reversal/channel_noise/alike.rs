//! Readings of a channel without what its traces differ by in height and slope.
//!
//! An indicator that is zeroed before each trace, a lost motion between the directions, and a drift along a trace shift
//! and tilt whole traces. That is no detail of a form, yet beside it a criterion takes detail for noise.

use super::survey::Survey;
use super::traces::{self, CellTrace, Group};

/// Passes over the traces; where all have readings in all cells the second changes nothing.
const PASSES: usize = 20;
/// Change of a height, relative to the greatest, at which the passes end.
const SETTLED: f64 = 1e-6;
/// Cells that a trace must share with others for a height, and as part of its own for a slope.
const FEWEST_CELLS: usize = 3;
const SHARED: f64 = 0.5;

/// Height, µm, and slope, µm per half the channel's travel, of what a trace lies above the others.
type Line = [f64; 2];

impl Survey<'_> {
    /// The readings of every channel, µm, less the lines by which its traces differ; the mean of these lines is left.
    /// `None` where no channel has more than one trace.
    pub fn alike(&self) -> Option<Vec<Vec<f64>>> {
        let several =
            |traces: &Vec<traces::Trace>| traces.iter().filter(|t| t.len() > 0).count() > 1;
        if !self.traces.iter().any(several) {
            return None;
        }
        let all = self.traces.iter().enumerate();
        Some(
            all.map(|(c, own)| match several(own) {
                true => self.channel_alike(c),
                false => self.values[c].to_vec(),
            })
            .collect(),
        )
    }

    fn channel_alike(&self, channel: usize) -> Vec<f64> {
        let (x, traces) = (self.x[channel], &self.traces[channel]);
        let mut values = self.values[channel].to_vec();
        let group = traces::of_channel(channel, x, traces);
        let (Some(first), Some(last)) = (x.first(), x.last()) else {
            return values;
        };
        let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
        let along = |x: f64| if half > 0.0 { (x - middle) / half } else { 0.0 };
        let xi: Vec<f64> = group.positions.iter().map(|x| along(*x)).collect();
        let means: Vec<Vec<(usize, f64)>> = group
            .traces
            .iter()
            .zip(&group.on_cells)
            .map(|(t, cells)| cell_means(&traces[*t], cells, &values))
            .collect();
        let lines = lines(&group, &xi, &means);
        for (t, line) in group.traces.iter().zip(lines) {
            for k in 0..traces[*t].len() {
                let row = traces[*t].row(k);
                values[row] -= line[0] + line[1] * along(x[row]);
            }
        }
        values
    }
}

/// The cells of a trace with the mean of its readings.
fn cell_means(trace: &traces::Trace, on_cells: &CellTrace, values: &[f64]) -> Vec<(usize, f64)> {
    let mean = |range: &std::ops::Range<usize>| {
        range.clone().map(|k| values[trace.row(k)]).sum::<f64>() / range.len() as f64
    };
    let cells = on_cells.cells.iter();
    cells.map(|(cell, range)| (*cell, mean(range))).collect()
}

/// By how much each trace lies above what all have in common, found in turns with it.
fn lines(group: &Group, xi: &[f64], means: &[Vec<(usize, f64)>]) -> Vec<Line> {
    let mut count = vec![0.0; group.positions.len()];
    for (cell, _) in means.iter().flatten() {
        count[*cell] += 1.0;
    }
    let shared: Vec<Vec<(usize, f64)>> = means
        .iter()
        .map(|own| own.iter().copied().filter(|m| count[m.0] > 1.0).collect())
        .collect();
    let mut lines = vec![[0.0; 2]; means.len()];
    for _ in 0..PASSES {
        let mut common = vec![0.0; count.len()];
        for (own, line) in shared.iter().zip(&lines) {
            for (cell, mean) in own {
                common[*cell] += (mean - line[0] - line[1] * xi[*cell]) / count[*cell];
            }
        }
        let before = lines.clone();
        for ((line, own), all) in lines.iter_mut().zip(&shared).zip(means) {
            let above = own
                .iter()
                .map(|(cell, mean)| (xi[*cell], mean - common[*cell]));
            *line = fitted(&above.collect::<Vec<_>>(), all.len());
        }
        let n = lines.len() as f64;
        let mean = [0, 1].map(|j| lines.iter().map(|l| l[j]).sum::<f64>() / n);
        for line in &mut lines {
            line[0] -= mean[0];
            line[1] -= mean[1];
        }
        let greatest =
            |all: &mut dyn Iterator<Item = f64>| all.fold(0.0, |m: f64, v| m.max(v.abs()));
        let moved = greatest(
            &mut lines
                .iter()
                .zip(&before)
                .flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]]),
        );
        if moved <= SETTLED * greatest(&mut lines.iter().flatten().copied()) {
            break;
        }
    }
    lines
}

/// The least-squares line; without slope where it covers little of a trace.
fn fitted(points: &[(f64, f64)], whole: usize) -> Line {
    if points.len() < FEWEST_CELLS {
        return [0.0; 2];
    }
    let n = points.len() as f64;
    let [x, y] = [
        points.iter().map(|p| p.0).sum::<f64>() / n,
        points.iter().map(|p| p.1).sum::<f64>() / n,
    ];
    let (mut product, mut spread) = (0.0, 0.0);
    for p in points {
        product += (p.0 - x) * (p.1 - y);
        spread += (p.0 - x) * (p.0 - x);
    }
    let slope = match n >= SHARED * whole as f64 && spread > 0.0 {
        true => product / spread,
        false => 0.0,
    };
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
}
