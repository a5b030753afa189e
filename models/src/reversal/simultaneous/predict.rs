//! What a solution says of a reading that was not taken, and the derivatives of all that were.

use std::collections::BTreeMap;

use errsep_solvers::problem::NoValue;
use nalgebra::DMatrix;

use super::effects::times;
use super::readings::ChannelReadings;
use super::row_source::RowSource;
use super::solution::Simultaneous;
use super::unknowns::Form;
use crate::reversal::forward::Attitude;
use crate::reversal::{Channel, Observations};
use crate::units::{UM_PER_MM, mm_from_um};

/// Most readings for which a dense Jacobian is handed out.
pub const MOST_DENSE_READINGS: usize = 20_000;

/// A prediction and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// What the channel would read, µm.
    pub value: f64,
    /// Derivatives by unknowns of the band; an unknown may appear once a form.
    pub band: Vec<(usize, f64)>,
    /// Derivatives by all unknowns of the border.
    pub border: Vec<f64>,
}

impl Simultaneous {
    /// What a channel would read at a slide position without the effects in the fit, µm, with the
    /// derivatives by the unknowns of band and border.
    ///
    /// # Errors
    /// [`NoValue`] for a channel that was not read, or where the probe touches in two places.
    pub fn predict(&self, channel: Channel, x: f64) -> Result<Prediction, NoValue> {
        let c = self
            .channels()
            .iter()
            .position(|k| *k == channel)
            .ok_or_else(|| NoValue::new(format!("channel {} was not read", channel.name())))?;
        let attitude = Attitude::new(
            self.unknowns.slope(c, &self.parameters.border),
            self.thickness_mm / 2.0,
        )?;
        let side = self.unknowns.side_of(channel);
        let height_of = |u: f64| self.value_of(side, u);
        let u = attitude.contact(x, |u| {
            let (height, slope) = height_of(u);
            (mm_from_um(height), mm_from_um(slope))
        })?;
        let (height, slope) = height_of(u);
        let (height, slope) = (mm_from_um(height), mm_from_um(slope));
        let (sin, cos) = (attitude.sin, attitude.cos);
        let q = 1.0 / (cos - slope * sin);
        let across = u * sin + (attitude.half_mm + height) * cos;
        let mut border = vec![0.0; self.unknowns.border_count()];
        let turn = UM_PER_MM * (x + (sin + slope * cos) * across * q);
        for (j, sign) in self.unknowns.slope_signs(c).enumerate() {
            border[j] = sign * turn;
        }
        border[self.unknowns.offset(c)] = 1.0;
        let mut line = |form: usize, factor: f64, at: f64| {
            let [height, slope] = self.unknowns.line(form);
            border[height] = -factor;
            border[slope] = -factor * self.axis.xi(at);
        };
        line(side, q, u);
        let mut value = UM_PER_MM * attitude.reading_mm(u, height)
            + self.parameters.border[self.unknowns.offset(c)];
        let mut band = Vec::with_capacity(8);
        if let Some(slide) = self.unknowns.place(Form::Slide) {
            let sign = channel.indicator_sign();
            value += sign * self.value_of(slide, x).0;
            line(slide, sign, x);
            self.push_basis(slide, x, sign, &mut band);
        }
        self.push_basis(side, u, q, &mut band);
        if let Some(thickness) = self.unknowns.thickness_index() {
            border[thickness] = 0.5 * UM_PER_MM * (q - 1.0);
        }
        Ok(Prediction {
            value,
            band,
            border,
        })
    }

    /// Standard uncertainty of the difference between what a channel would read at two slide positions, µm, of
    /// readings with the noise of the weights.
    ///
    /// # Errors
    /// As [`Self::predict`].
    pub(in crate::reversal) fn difference_std(
        &self,
        channel: Channel,
        from: f64,
        to: f64,
    ) -> Result<f64, NoValue> {
        let (from, to) = (self.predict(channel, from)?, self.predict(channel, to)?);
        let mut band: BTreeMap<usize, f64> = BTreeMap::new();
        for (sign, prediction) in [(-1.0, &from), (1.0, &to)] {
            for (unknown, derivative) in &prediction.band {
                *band.entry(*unknown).or_default() += sign * derivative;
            }
        }
        let band: Vec<(usize, f64)> = band.into_iter().collect();
        let pairs = from.border.iter().zip(&to.border).enumerate();
        let border: Vec<(usize, f64)> = pairs
            .map(|(unknown, (from, to))| (unknown, to - from))
            .filter(|(_, derivative)| *derivative != 0.0)
            .collect();
        Ok(self.covariance.variance(&band, &border).max(0.0).sqrt())
    }
    /// unit), dense, readings × unknowns: coefficients of the forms with the gauge taken into
    /// account, then tilts (rad), offsets (µm), where fitted the thickness (mm), and the effects' own.
    ///
    /// # Errors
    /// [`NoValue`] beyond [`MOST_DENSE_READINGS`] readings: such a matrix has no place in memory.
    pub fn jacobian(&self, observations: &Observations) -> Result<DMatrix<f64>, NoValue> {
        let rows = observations.readings.len();
        if rows > MOST_DENSE_READINGS {
            return Err(NoValue::new(format!(
                "a dense Jacobian is made for at most {MOST_DENSE_READINGS} readings, here are {rows}"
            )));
        }
        let n = self.unknowns.band_count();
        let (lines, kept) = (self.unknowns.lines(), self.unknowns.kept());
        let mut jacobian = DMatrix::zeros(rows, n + kept.len());
        let channels = ChannelReadings::sort(observations);
        let times = times(observations);
        let joined = self.joined(observations, &times);
        let problem = self.problem(&channels, joined.as_ref());
        let source = RowSource::new(self, &problem)?;
        for (c, channel) in channels.iter().enumerate() {
            for (row, i) in channel.source.iter().enumerate() {
                let i = *i as usize;
                let prediction = source.row(c, row)?;
                for (j, value) in &prediction.band {
                    jacobian[(i, *j)] += value;
                }
                for (line, column) in lines.iter().zip(&self.gauge.band) {
                    let through = prediction.border[*line];
                    if through != 0.0 {
                        for (j, w) in column.iter().enumerate() {
                            jacobian[(i, j)] += through * w;
                        }
                    }
                }
                for (l, j) in kept.iter().enumerate() {
                    jacobian[(i, n + l)] = prediction.border[*j];
                }
            }
        }
        Ok(jacobian)
    }

    /// The names of the columns of [`Self::jacobian`].
    pub fn jacobian_names(&self) -> Vec<String> {
        let band =
            (0..self.unknowns.band_count()).map(|j| self.unknowns.band_name(j, &self.knots.breaks));
        let border = self
            .unknowns
            .kept()
            .into_iter()
            .map(|j| self.unknowns.border_name(j));
        band.chain(border).collect()
    }
}
