//! The tilts: the line of each channel and the contrasts of the slopes.

use nalgebra::DMatrix;

use super::estimates::{ErrorEstimates, rms};
use super::line::Line;
use super::rotation::{angle_of_slope, sheared};
use super::trace::Trace;
use super::{ChannelLine, Tilt, Value};
use crate::reversal::combinations::determined;
use crate::reversal::convention::{Contrast, Convention};
use crate::units::mm_from_um;

pub(super) fn channel_lines(
    traces: &[Trace],
    fits: &[Line],
    estimates: Vec<ErrorEstimates>,
    sigma: f64,
) -> Vec<ChannelLine> {
    traces
        .iter()
        .zip(fits)
        .zip(estimates)
        .map(|((t, line), estimates)| {
            let tilt = angle_of_slope(line.slope);
            // d(arctan s) = ds cos².
            let std = mm_from_um(sigma / line.spread.sqrt()) * tilt.cos().powi(2);
            ChannelLine {
                channel: t.channel,
                readings: t.count.iter().sum::<f64>() as usize,
                positions: t.x.len(),
                tilt: Value { value: tilt, std },
                offset: line.at(0.0),
                rest_rms: rms(&sheared(t, line).1),
                direction_difference: t.direction_difference,
                estimates,
            }
        })
        .collect()
}

pub(super) fn weighted(lines: &[ChannelLine], weights: &[f64]) -> Value {
    let terms = || lines.iter().zip(weights);
    Value {
        value: terms().map(|(l, w)| w * l.tilt.value).sum(),
        std: terms()
            .map(|(l, w)| (w * l.tilt.std).powi(2))
            .sum::<f64>()
            .sqrt(),
    }
}

pub(super) fn contrasts(lines: &[ChannelLine]) -> [(Contrast, Value); 4] {
    Contrast::ALL.map(|c| {
        let weights = lines
            .iter()
            .map(|l| c.sign(l.channel) / 4.0)
            .collect::<Vec<_>>();
        (c, weighted(lines, &weights))
    })
}

pub(super) fn solve_tilts(lines: &[ChannelLine], convention: Convention) -> Vec<Tilt> {
    let unknowns = convention.tilts();
    let design = DMatrix::from_fn(lines.len(), 3, |r, c| unknowns[c].sign(lines[r].channel));
    let names = unknowns.map(|c| c.name(convention));
    determined(&design, &[])
        .into_iter()
        .map(|combination| Tilt {
            name: combination.name(&names),
            angle: weighted(lines, &combination.weights),
            combination,
        })
        .collect()
}
