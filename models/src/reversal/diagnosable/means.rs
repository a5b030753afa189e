//! Means of the traces of each channel, and the forms of single repeats.

use std::borrow::Cow;
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
        let observed = self.each_by_itself();
        let of = |k: usize| {
            let repeats: Vec<u32> = own.iter().map(|repeats| repeats[k]).collect();
            let means = self.channel_means(&observed, Some(&repeats));
            self.arrangement.forms(&means, self.positions.len())
        };
        (0..fewest).filter_map(of).collect()
    }

    /// The readings, those that were put in by the cubic through what the trace itself has on either side: what
    /// other repeats told would be noise that repeats have in common.
    fn each_by_itself(&self) -> Cow<'_, DVector<f64>> {
        let lacking = self.gathered.as_ref().map_or(&[][..], |g| &g.lacking);
        if lacking.is_empty() {
            return Cow::Borrowed(&self.record.observed);
        }
        let mut own = self.record.observed.clone();
        let n = self.positions.len();
        let there = |row: &usize| lacking.binary_search(row).is_err();
        for &row in lacking {
            let start = row - row % n;
            let before = (start..row).rev().filter(there).take(2);
            let after = (row + 1..start + n).filter(there).take(2);
            let nodes: Vec<usize> = before.chain(after).collect();
            let x = |row: usize| self.positions[row % n];
            let weight = |j: usize| {
                let others = nodes.iter().filter(|i| **i != j);
                others
                    .map(|i| (x(row) - x(*i)) / (x(j) - x(*i)))
                    .product::<f64>()
            };
            own[row] = (nodes.iter())
                .map(|j| weight(*j) * self.record.observed[*j])
                .sum();
        }
        Cow::Owned(own)
    }
}
