//! Means of the traces of each channel, and the forms of single repeats.

use std::collections::BTreeSet;

use nalgebra::DVector;

use super::Linearised;

impl Linearised {
    /// Mean profile of every channel over its traces, or those of one repeat a channel, where it has any.
    pub(super) fn channel_means(
        &self,
        values: &DVector<f64>,
        repeats: Option<&[u32]>,
    ) -> Vec<Option<DVector<f64>>> {
        let n = self.positions.len();
        let of = |channel: usize| {
            let mut sum = DVector::zeros(n);
            let mut count = 0.0;
            for (trace, _) in self
                .record
                .traces
                .iter()
                .zip(&self.trace_channels)
                .filter(|(_, c)| **c == channel)
                .filter(|(t, c)| {
                    repeats.is_none_or(|own| self.record.places[t.start].repeat == own[**c])
                })
            {
                sum += values.rows(trace.start, n);
                count += 1.0;
            }
            (count > 0.0).then(|| sum / count)
        };
        (0..self.present().len()).map(of).collect()
    }

    /// The forms of one repeat of every channel after the other: as many as the channel with the fewest has, since
    /// without a channel forms are others.
    pub(super) fn forms_of_repeats(&self) -> Vec<Vec<DVector<f64>>> {
        let mut own = vec![BTreeSet::new(); self.present().len()];
        for (trace, channel) in self.record.traces.iter().zip(&self.trace_channels) {
            own[*channel].insert(self.record.places[trace.start].repeat);
        }
        let own: Vec<Vec<u32>> = own.into_iter().map(|r| r.into_iter().collect()).collect();
        let fewest = own.iter().map(Vec::len).min().unwrap_or(0);
        let of = |k: usize| {
            let repeats: Vec<u32> = own.iter().map(|repeats| repeats[k]).collect();
            let means = self.channel_means(&self.record.observed, Some(&repeats));
            self.arrangement.forms(&means, self.positions.len())
        };
        (0..fewest).filter_map(of).collect()
    }
}
