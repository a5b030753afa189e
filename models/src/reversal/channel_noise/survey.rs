//! The readings of all channels by trace, and their repeats.

use super::levels::Levels;
use super::passes::{self, BothWays};
use super::traces::{self, Group, Trace};
use super::{Seat, SortedReadings};
use crate::noise::WithinCells;
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
    /// By channel, how indicator and spindle stand.
    pub(super) seats: Vec<Seat>,
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
            seats: channels.iter().map(SortedReadings::seat).collect(),
        }
    }

    /// Whether the zeros are set anew between passes each way.
    pub fn passes_are_zeroed(&self) -> bool {
        passes::are_zeroed(&self.both_ways())
    }

    /// The passes of the channels that were read each way.
    fn both_ways(&self) -> Vec<BothWays> {
        let of = |c: usize| {
            let (x, traces) = (self.x[c], &self.traces[c]);
            let group = traces::of_channel(c, x, traces);
            let (low, high) = (group.positions.first()?, group.positions.last()?);
            // By direction and cell: the sum of the traces' means, and how many.
            let mut sums = [false, true].map(|_| vec![(0.0, 0.0); group.positions.len()]);
            let means = group.means(traces, x, self.values[c]);
            for (t, own) in group.traces.iter().zip(&means) {
                let sums = &mut sums[usize::from(traces[*t].backward)];
                for (cell, mean) in own {
                    sums[*cell].0 += mean;
                    sums[*cell].1 += 1.0;
                }
            }
            let [forward, backward] = &sums;
            let both = || {
                let cells = forward.iter().zip(backward).zip(&group.positions);
                cells.filter(|((f, b), _)| f.1 > 0.0 && b.1 > 0.0)
            };
            // A difference of means over m and n has 1/m + 1/n of a reading's variance.
            let parts: f64 = both().map(|((f, b), _)| 0.5 / f.1 + 0.5 / b.1).sum();
            let repeats = both().count() as f64 / parts;
            let differences = both().map(|((f, b), x)| {
                let along = (x - low) / (high - low);
                (2.0 * along - 1.0, b.0 / b.1 - f.0 / f.1)
            });
            BothWays::of(self.indicator(c), repeats, &differences.collect::<Vec<_>>())
        };
        (0..self.channels()).filter_map(of).collect()
    }

    /// Which of the indicators reads a channel: the first channel of the same.
    pub(super) fn indicator(&self, channel: usize) -> usize {
        let of_one = |seat: &Seat| seat.has_indicator_of(&self.seats[channel]);
        self.seats.iter().position(of_one).unwrap_or(channel)
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.x.len()
    }

    /// The mean step of a trace, mm, and its readings on average; `None` where no trace has two.
    pub fn pass(&self) -> Option<(f64, usize)> {
        let (mut travel, mut steps, mut count) = (0.0, 0, 0);
        for (x, traces) in self.x.iter().zip(&self.traces) {
            for trace in traces.iter().filter(|t| t.len() > 1) {
                travel += (x[trace.row(trace.len() - 1)] - x[trace.row(0)]).abs();
                steps += trace.len() - 1;
                count += 1;
            }
        }
        let step = travel / steps as f64;
        (step > 0.0).then(|| (step, 1 + steps / count))
    }

    /// Over how much the first positions of the traces spread, and the last, mm.
    pub fn spread_of_ends(&self) -> [f64; 2] {
        let traces = self.x.iter().zip(&self.traces);
        straight_line::spread_of_ends(traces.flat_map(|(x, traces)| {
            let ends = |t: &Trace| [x[t.row(0)], x[t.row(t.len() - 1)]];
            traces.iter().filter(|t| t.len() > 0).map(ends)
        }))
    }

    /// The channel of the opposite indicator that has a trace of the same number, direction and positions.
    pub fn read_together(&self, channel: usize, trace: &Trace) -> Option<usize> {
        let is_partner = |other: &Trace| {
            (other.backward, other.repeat, other.len())
                == (trace.backward, trace.repeat, trace.len())
        };
        (0..self.channels()).find(|other| {
            let same = |partner: &Trace| {
                (0..trace.len())
                    .all(|k| self.x[channel][trace.row(k)] == self.x[*other][partner.row(k)])
            };
            self.seats[channel].is_opposite(&self.seats[*other])
                && (self.traces[*other].iter()).any(|own| is_partner(own) && same(own))
        })
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

    /// The values of groups beside the means of their cells.
    pub fn within_cells(&self, groups: &[Group], values: &[Vec<f64>]) -> WithinCells {
        let of_trace = |group: &Group, trace: usize| {
            let rows = &self.traces[group.channel][group.traces[trace]];
            let (x, own) = (self.x[group.channel], &values[group.channel]);
            let mut within = WithinCells::default();
            for (_, range) in &group.on_cells[trace].cells {
                let ends = [range.start, range.end - 1].map(|k| x[rows.row(k)]);
                within.add(ends[1] - ends[0], range.clone().map(|k| own[rows.row(k)]));
            }
            within
        };
        let mut all = WithinCells::default();
        for group in groups {
            for trace in 0..group.traces.len() {
                all.extend(&of_trace(group, trace));
            }
        }
        all
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
