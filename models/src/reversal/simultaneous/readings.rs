//! Readings sorted by channel and position, as the fit goes through them.

use rayon::prelude::*;

use crate::reversal::{Channel, Observations};

/// The readings of one channel in growing order of position.
#[derive(Debug, Clone)]
pub struct ChannelReadings {
    /// Which channel.
    pub channel: Channel,
    /// Positions, mm, not decreasing.
    pub x: Vec<f64>,
    /// Readings, µm.
    pub value: Vec<f64>,
    /// Where each reading stands in the observations.
    pub source: Vec<u32>,
    /// Numbers that were fitted to the readings and taken out of them before.
    pub taken_out: usize,
}

impl ChannelReadings {
    /// Sorts the observations; channels without a reading are left out.
    pub fn sort(observations: &Observations) -> Vec<Self> {
        let mut counts = [0; 4];
        for reading in &observations.readings {
            counts[reading.channel.index()] += 1;
        }
        Channel::ALL
            .into_par_iter()
            .filter(|channel| counts[channel.index()] > 0)
            .map(|channel| {
                let count = counts[channel.index()];
                let mut sorted = Self {
                    channel,
                    x: Vec::with_capacity(count),
                    value: Vec::with_capacity(count),
                    source: Vec::with_capacity(count),
                    taken_out: 0,
                };
                for (i, reading) in (0_u32..).zip(&observations.readings) {
                    if reading.channel == channel {
                        sorted.x.push(reading.x);
                        sorted.value.push(reading.value);
                        sorted.source.push(i);
                    }
                }
                if !sorted.x.is_sorted() {
                    let reading = |i: u32| &observations.readings[i as usize];
                    sorted
                        .source
                        .sort_by(|a, b| reading(*a).x.total_cmp(&reading(*b).x));
                    sorted.x.clear();
                    sorted.x.extend(sorted.source.iter().map(|i| reading(*i).x));
                    sorted.value.clear();
                    let values = sorted.source.iter().map(|i| reading(*i).value);
                    sorted.value.extend(values);
                }
                sorted
            })
            .collect()
    }

    /// At most `most` readings, evenly spread, of each of the stretches that begin at `starts`
    /// (places among the readings; the last is the end).
    pub fn thinned(&self, starts: &[usize], most: usize) -> Self {
        let mut thin = Self {
            channel: self.channel,
            x: Vec::new(),
            value: Vec::new(),
            source: Vec::new(),
            taken_out: self.taken_out,
        };
        for pair in starts.windows(2) {
            let count = pair[1].saturating_sub(pair[0]);
            let kept = count.min(most);
            for k in 0..kept {
                let i = pair[0] + (2 * k + 1) * count / (2 * kept);
                thin.x.push(self.x[i]);
                thin.value.push(self.value[i]);
                thin.source.push(self.source[i]);
            }
        }
        thin
    }

    /// Number of readings.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is no reading.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Slope (µm/mm) of the least-squares line and its height (µm) at x = 0; `None` where all
    /// positions are equal.
    pub fn line(&self) -> Option<(f64, f64)> {
        let n = self.len() as f64;
        let center = self.x.iter().sum::<f64>() / n;
        let mean = self.value.iter().sum::<f64>() / n;
        let (product, spread) =
            self.x
                .iter()
                .zip(&self.value)
                .fold((0.0, 0.0), |(product, spread), (x, y)| {
                    let d = x - center;
                    (product + d * (y - mean), spread + d * d)
                });
        (spread > 0.0).then(|| (product / spread, mean - product / spread * center))
    }
}
