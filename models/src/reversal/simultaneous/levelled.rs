//! Repeats brought to one height before the fit, as a mean over repeats of which one ends before the others would have a step; and
//! passes each way that are zeroed anew.

use super::options::Options;
use super::readings::ChannelReadings;
use super::solution::Simultaneous;
use crate::reversal::channel_noise::survey::Survey;

/// The readings with repeats at one height.
pub(super) struct Level {
    pub(super) channels: Vec<ChannelReadings>,
    /// The greatest height taken out, µm.
    greatest: f64,
}

impl Level {
    /// Where repeats stand apart that were not read at the same positions, or passes are zeroed anew. Effects know readings as they are.
    pub(super) fn of(survey: &Survey, read: &[ChannelReadings], options: &Options) -> Option<Self> {
        if !options.effects.is_empty() {
            return None;
        }
        let level = survey.levelled().filter(|level| level.matters)?;
        let taken_out: Vec<usize> = (0..read.len()).map(|c| level.taken_out(c)).collect();
        let mut channels = with_values(read, level.values);
        for (channel, taken_out) in channels.iter_mut().zip(taken_out) {
            channel.taken_out = taken_out;
        }
        Some(Self {
            channels,
            greatest: level.greatest,
        })
    }

    /// Puts the heights back into the residuals, which are those of the readings.
    pub(super) fn tell(&self, read: &[ChannelReadings], solution: &mut Simultaneous) {
        for (read, level) in read.iter().zip(&self.channels) {
            let heights = read.value.iter().zip(&level.value).map(|(r, l)| r - l);
            for (i, height) in read.source.iter().zip(heights) {
                solution.residuals[*i as usize] += height;
            }
        }
        solution.levelled_um = Some(self.greatest);
    }
}

/// The same channels with other values.
pub(super) fn with_values(
    channels: &[ChannelReadings],
    values: Vec<Vec<f64>>,
) -> Vec<ChannelReadings> {
    let of = |(channel, value): (&ChannelReadings, _)| ChannelReadings {
        value,
        ..channel.clone()
    };
    channels.iter().zip(values).map(of).collect()
}
