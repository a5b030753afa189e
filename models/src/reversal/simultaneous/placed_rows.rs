//! The rows of placed readings, as the structured solver and its checks take them.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::Share;
use errsep_solvers::loss::Loss;
use errsep_solvers::structured::Sink;

use super::placed::{Placed, Spot};
use super::predict::Prediction;
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::robust::Robust;
use super::unknowns::Form;
use crate::basis::bspline::horner;
use crate::units::UM_PER_MM;

impl Placed {
    /// What a reading would show, with its derivatives by all unknowns.
    pub fn prediction(&self, problem: &Reversal, channel: usize, row: usize) -> Prediction {
        let unknowns = &problem.unknowns;
        let spot = &self.channels[channel].spots[row];
        let name = problem.channels[channel].channel;
        let mut border = vec![0.0; unknowns.border_count()];
        for (j, sign) in unknowns.slope_signs(channel).enumerate() {
            border[j] = sign * spot.scale * spot.turn;
        }
        border[unknowns.offset(channel)] = spot.scale;
        let mut band = Vec::with_capacity(8);
        let mut form = |form: usize, cell: u32, t: f64, factor: f64| {
            let basis = &problem.bases[form];
            let (left, width) = basis.cell(cell as usize);
            let [height, slope] = unknowns.line(form);
            border[height] = -factor;
            border[slope] = -factor * problem.axis.xi(left + t * width);
            for (l, function) in basis.polynomials(cell as usize).iter().enumerate() {
                if let Some(j) = unknowns.coefficient(form, cell as usize + l) {
                    band.push((j, factor * horner(function, t)));
                }
            }
        };
        if let Some(slide) = unknowns.place(Form::Slide) {
            form(
                slide,
                spot.slide,
                spot.t_slide,
                spot.scale * name.indicator_sign(),
            );
        }
        form(
            unknowns.side_of(name),
            spot.side,
            spot.t_side,
            spot.scale * spot.q,
        );
        if let Some(thickness) = unknowns.thickness_index() {
            border[thickness] = spot.scale * 0.5 * UM_PER_MM * (spot.q - 1.0);
        }
        for (k, v) in self.by(channel, row).iter().enumerate() {
            border[unknowns.effect(k)] = *v;
        }
        Prediction {
            value: spot.shows,
            band,
            border,
        }
    }

    /// Fills a batch with the rows of some readings of one channel that lie in the same two cells;
    /// weighted residuals last.
    pub fn fill(&self, problem: &Reversal, channel: usize, rows: &[u32], batch: &mut Tall) {
        let own = &self.channels[channel];
        let readings = &problem.channels[channel];
        let weight = problem.weights[channel];
        let Some(first) = rows.first().map(|row| &own.spots[*row as usize]) else {
            return;
        };
        let spots = || rows.iter().map(|row| &own.spots[*row as usize]);
        let unknowns = &problem.unknowns;
        let slide = unknowns.place(Form::Slide);
        let apart = if slide.is_some() { 2 } else { 1 };
        if let Some(form) = slide {
            let signed = weight * readings.channel.indicator_sign();
            let basis = problem.bases[form].polynomials(first.slide as usize);
            for (k, function) in basis.iter().enumerate() {
                for (out, s) in batch.column_mut(2 * k).iter_mut().zip(spots()) {
                    *out = signed * s.scale * horner(function, s.t_slide);
                }
            }
        }
        let form = unknowns.side_of(readings.channel);
        let basis = problem.bases[form].polynomials(first.side as usize);
        for (k, function) in basis.iter().enumerate() {
            let column = batch.column_mut(apart * k + apart - 1);
            for (out, s) in column.iter_mut().zip(spots()) {
                *out = weight * s.scale * s.q * horner(function, s.t_side);
            }
        }
        let mut next = 4 * apart;
        let mut put = |batch: &mut Tall, of: &dyn Fn(&Spot) -> f64| {
            for (out, s) in batch.column_mut(next).iter_mut().zip(spots()) {
                *out = weight * of(s);
            }
            next += 1;
        };
        put(batch, &|s| s.scale * s.turn);
        if slide.is_none() {
            put(batch, &|s| s.scale);
        }
        if unknowns.thickness {
            put(batch, &|s| s.scale * 0.5 * UM_PER_MM * (s.q - 1.0));
        }
        for k in 0..self.effects {
            for (out, row) in batch.column_mut(next + k).iter_mut().zip(rows) {
                *out = weight * own.by[*row as usize * self.stride + k];
            }
        }
        let last = next + self.effects;
        for (out, row) in batch.column_mut(last).iter_mut().zip(rows) {
            let i = *row as usize;
            *out = weight * (own.spots[i].shows - readings.value[i]);
        }
    }

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
