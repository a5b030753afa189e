//! The tilts: the line of each channel and the contrasts of the slopes.

use nalgebra::{DMatrix, DVector};

use super::drift::Drifts;
use super::estimates::{ErrorEstimates, rms};
use super::joint::Joint;
use super::line::Line;
use super::rotation::{angle_of_slope, sheared};
use super::trace::Trace;
use super::{ChannelLine, Tilt, Value};
use crate::reversal::Channel;
use crate::reversal::combinations::determined;
use crate::reversal::convention::{Contrast, Convention};
use crate::units::mm_from_um;

/// The channels' tilts, and their covariance for noise σ, rad².
pub(super) struct Tilts {
    pub(super) values: Vec<f64>,
    covariance: DMatrix<f64>,
    /// Degrees of freedom, where the noise of one reading is known with as many as were given.
    pub(super) freedom: f64,
}

impl Tilts {
    /// With what the drifts of repeats add to the covariance of the channels' slopes, (µm/mm)², and by how much
    /// each slope may be off as its line was not rotated, µm/mm.
    pub(super) fn of(
        joint: &Joint,
        (sigma, freedom): (f64, f64),
        drifts: &Drifts,
        sheared: &[f64],
    ) -> Self {
        let values: Vec<f64> = joint
            .lines
            .iter()
            .map(|l| angle_of_slope(l.slope))
            .collect();
        // d(arctan s) = ds cos².
        let gain: Vec<f64> = (values.iter())
            .map(|tilt| mm_from_um(sigma) * tilt.cos().powi(2))
            .collect();
        let slopes = joint.slopes();
        let mut covariance = slopes.map_with_location(|r, c, v| v * gain[r] * gain[c]);
        let gain: Vec<f64> = (values.iter())
            .map(|tilt| mm_from_um(1.0) * tilt.cos().powi(2))
            .collect();
        let added = (drifts.covariance).map_with_location(|r, c, v| v * gain[r] * gain[c]);
        // Welch and Satterthwaite, the least of the channels.
        let of = |c: usize| {
            let (white, drift) = (covariance[(c, c)], added[(c, c)]);
            let doubt = white * white / freedom + drift * drift / drifts.freedom;
            (white + drift).powi(2) / doubt
        };
        let least = (0..values.len()).map(of).fold(f64::INFINITY, f64::min);
        covariance += &added;
        for (c, slope) in sheared.iter().enumerate() {
            covariance[(c, c)] += (gain[c] * slope).powi(2);
        }
        Self {
            values,
            covariance,
            freedom: least,
        }
    }

    /// Σ weight·tilt.
    pub(super) fn weighted(&self, weights: &[f64]) -> Value {
        let weights = DVector::from_column_slice(weights);
        Value {
            value: weights.iter().zip(&self.values).map(|(w, t)| w * t).sum(),
            std: weights.dot(&(&self.covariance * &weights)).max(0.0).sqrt(),
        }
    }

    fn one(&self, channel: usize) -> Value {
        Value {
            value: self.values[channel],
            std: self.covariance[(channel, channel)].max(0.0).sqrt(),
        }
    }
}

pub(super) fn channel_lines(
    traces: &[Trace],
    fits: &[Line],
    estimates: Vec<ErrorEstimates>,
    tilts: &Tilts,
) -> Vec<ChannelLine> {
    traces
        .iter()
        .zip(fits)
        .zip(estimates)
        .enumerate()
        .map(|(c, ((t, line), estimates))| ChannelLine {
            channel: t.channel,
            readings: t.count.iter().sum::<f64>() as usize,
            positions: t.x.len(),
            tilt: tilts.one(c),
            offset: line.at(0.0),
            rest_rms: rms(&sheared(t, line).1),
            direction_difference: t.direction_difference,
            estimates,
        })
        .collect()
}

pub(super) fn contrasts(tilts: &Tilts) -> [(Contrast, Value); 4] {
    Contrast::ALL.map(|c| (c, tilts.weighted(&Channel::ALL.map(|k| c.sign(k) / 4.0))))
}

pub(super) fn solve_tilts(
    tilts: &Tilts,
    channels: &[Channel],
    convention: Convention,
) -> Vec<Tilt> {
    let unknowns = convention.tilts();
    let design = DMatrix::from_fn(channels.len(), 3, |r, c| unknowns[c].sign(channels[r]));
    let names = unknowns.map(|c| c.name(convention));
    determined(&design, &[])
        .into_iter()
        .map(|combination| Tilt {
            name: combination.name(&names),
            angle: tilts.weighted(&combination.weights),
            combination,
        })
        .collect()
}
