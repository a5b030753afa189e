//! The readings of all channels by trace, and their repeats.

use super::SortedReadings;
use super::levels::Levels;
use super::traces::{self, Group, Trace};
use crate::reversal::Direction;
use crate::reversal::simultaneous::Noise;
use crate::reversal::straight_line;

/// The readings by trace, and the repeats.
pub struct Survey<'a> {
    /// Positions by channel, mm.
    pub x: Vec<&'a [f64]>,
    /// Readings by channel, µm.
    pub(super) values: Vec<&'a [f64]>,
    pub traces: Vec<Vec<Trace>>,
    /// The repeats of each channel and direction; empty where nothing was repeated.
    pub repeats: Vec<Group>,
}

impl<'a> Survey<'a> {
    /// Looks through the readings; `taken` tells how one of the observations was taken.
    pub fn new<C: SortedReadings>(
        channels: &'a [C],
        taken: impl Fn(usize) -> (Direction, u32),
    ) -> Self {
        let x: Vec<&[f64]> = channels.iter().map(SortedReadings::x).collect();
        let traces = traces::of(channels, taken);
        let repeated = traces.iter().any(|t| t.len() > 1);
        let mut repeats = if repeated {
            traces::grouped(&x, &traces)
        } else {
            Vec::new()
        };
        if repeats.iter().all(|g| g.traces.len() < 2) {
            repeats.clear();
        }
        Self {
            x,
            values: channels.iter().map(SortedReadings::value).collect(),
            traces,
            repeats,
        }
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.x.len()
    }

    /// Over how much the first positions of the traces spread, and the last, mm.
    pub fn spread_of_ends(&self) -> [f64; 2] {
        let traces = self.x.iter().zip(&self.traces);
        straight_line::spread_of_ends(traces.flat_map(|(x, traces)| {
            let ends = |t: &Trace| [x[t.row(0)], x[t.row(t.len() - 1)]];
            traces.iter().filter(|t| t.len() > 0).map(ends)
        }))
    }

    /// The mean of a channel's values in each cell of a trace of a group; NaN in empty cells.
    pub fn cell_means(&self, group: &Group, trace: usize, values: &[Vec<f64>]) -> Vec<f64> {
        let rows = &self.traces[group.channel][group.traces[trace]];
        let own = &values[group.channel];
        let mut means = vec![f64::NAN; group.positions.len()];
        for (cell, range) in &group.on_cells[trace].cells {
            let sum: f64 = range.clone().map(|k| own[rows.row(k)]).sum();
            means[*cell] = sum / range.len() as f64;
        }
        means
    }

    /// The repeats of a group on the cells in which all have readings.
    pub fn complete_means(&self, group: &Group, values: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let complete = group.complete();
        (0..group.traces.len())
            .map(|t| {
                let means = self.cell_means(group, t, values);
                complete.iter().map(|cell| means[*cell]).collect()
            })
            .collect()
    }

    /// First guess of each channel's noise, µm, from the readings themselves.
    pub fn first_noise(&self, noise: Noise) -> Vec<f64> {
        match noise {
            Noise::Declared(sigma) => vec![sigma; self.channels()],
            Noise::Equal => vec![1.0; self.channels()],
            Noise::Estimated => Levels::along(&self.x, &self.traces, &self.values)
                .sigmas(&vec![1.0; self.channels()]),
        }
    }

    /// Residuals less the lines by which repeats of a channel differ, and how many numbers these lines are; as they are
    /// where nothing is repeated.
    pub fn left_of_repeats(&self, residuals: &[Vec<f64>]) -> (Vec<Vec<f64>>, usize) {
        if self.repeats.is_empty() {
            return (residuals.to_vec(), 0);
        }
        let more = self.repeats.iter().map(|g| g.traces.len() - 1);
        (self.without_lines(residuals), 2 * more.sum::<usize>())
    }

    /// What neighbours tell of each channel's noise: in contrasts of the repeats of every channel, else
    /// in the residuals.
    pub fn levels(&self, residuals: &[Vec<f64>]) -> Levels {
        let repeated = Levels::of_repeats(self.channels(), &self.repeats, |group| {
            self.complete_means(group, residuals)
        });
        if repeated.0.iter().all(|l| l.freedom > 0.0) {
            repeated
        } else {
            let values: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
            Levels::along(&self.x, &self.traces, &values)
        }
    }
}
