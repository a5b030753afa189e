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
}

impl ChannelReadings {
    /// Sorts the observations; channels without a reading are left out.
    pub fn sort(observations: &Observations) -> Vec<Self> {
        Channel::ALL
            .into_par_iter()
            .map(|channel| {
                let mut order: Vec<u32> = (0_u32..)
                    .zip(&observations.readings)
                    .filter(|(_, r)| r.channel == channel)
                    .map(|(i, _)| i)
                    .collect();
                let reading = |i: u32| &observations.readings[i as usize];
                if !order.is_sorted_by(|a, b| reading(*a).x <= reading(*b).x) {
                    order.sort_by(|a, b| reading(*a).x.total_cmp(&reading(*b).x));
                }
                Self {
                    channel,
                    x: order.iter().map(|i| reading(*i).x).collect(),
                    value: order.iter().map(|i| reading(*i).value).collect(),
                    source: order,
                }
            })
            .filter(|readings| !readings.is_empty())
            .collect()
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
