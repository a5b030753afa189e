//! The rows of placed readings, as the structured solver and its checks take them.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::Share;
use errsep_solvers::loss::Loss;
use errsep_solvers::structured::Sink;

use super::placed::Placed;
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::robust::Robust;
use super::unknowns::Form;

impl Placed {
    /// Reading less model, µm, by channel in the order of its sorted readings.
    pub fn residuals(&self, channels: &[ChannelReadings]) -> Vec<Vec<f64>> {
        let channels = self.channels.iter().zip(channels);
        channels
            .map(|(own, readings)| {
                let pairs = readings.value.iter().zip(&own.spots);
                pairs.map(|(value, spot)| value - spot.shows).collect()
            })
            .collect()
    }

    /// Pushes the rows of one cell of a channel into the sink.
    pub fn task(&self, problem: &Reversal, channel: usize, cell: usize, sink: &mut Sink) {
        self.stretches(channel, cell, |rows, side, slide| {
            sink.open(columns(problem));
            for rows in rows.chunks(Tall::CAPACITY) {
                let batch = sink.batch(rows.len());
                self.fill(problem, channel, rows, batch);
                if problem.loss == Loss::Quadratic {
                    sink.push();
                } else {
                    let last = batch.column(batch.columns() - 1);
                    let robust = Robust::of(problem.loss, problem.far, last);
                    robust.scale_rows(batch);
                    robust.replace_residuals(batch);
                    sink.push_with_cost(robust.cost);
                }
            }
            let band = problem.band_columns(channel, side, slide);
            sink.close(band, problem.shares(channel, side, slide), channel);
        });
    }

    /// Hands out all rows one by one: see [`Reversal::for_each_batch`].
    pub fn for_each_row(
        &self,
        problem: &Reversal,
        mut take: impl FnMut(usize, usize, &[Option<usize>], &[Share], &Tall),
    ) {
        let mut batch = Tall::new(16);
        for channel in 0..problem.channels.len() {
            for cell in 0..problem.cell_count() {
                self.stretches(channel, cell, |rows, side, slide| {
                    let band = problem.band_columns(channel, side, slide);
                    let shares = problem.shares(channel, side, slide);
                    for row in rows.chunks(1) {
                        batch.reset(1, columns(problem));
                        self.fill(problem, channel, row, &mut batch);
                        take(channel, row[0] as usize, &band, &shares, &batch);
                    }
                });
            }
        }
    }
}

/// Local columns of a row, the residual included.
fn columns(problem: &Reversal) -> usize {
    let unknowns = &problem.unknowns;
    let forms = if unknowns.place(Form::Slide).is_some() {
        9
    } else {
        6
    };
    forms + 1 + usize::from(unknowns.thickness) + unknowns.effects.len()
}
