//! What the readings hold that the orders kept, or the noise, do not explain.

use super::group::{Group, common, information};
use super::noise::{NoiseSource, finer_half};
use crate::uncertainty::{DegreesOfFreedom, TOLD_BELOW, exceeding};
use serde::{Deserialize, Serialize};

/// Form of the workpiece that is finer than the orders kept.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BeyondOrders {
    /// Root mean square of that form, µm, noise taken out: of the difference signal, over √2, which
    /// is what the orders beyond pass on average.
    pub rms: f64,
    /// Probability that noise alone shows as much.
    pub p_value: f64,
}

/// Tests the orders beyond those kept, the fitted steps taken off: the whole of them, the 1, 2, 4, …
/// next to those kept (where the form of machined parts has most), and each by itself; the least of
/// the probabilities times the number of tests. Nothing where there are no such orders or where noise
/// shows as much with a probability above [`TOLD_BELOW`].
pub(super) fn beyond_orders(
    groups: &[Group],
    steps: &[f64],
    orders: usize,
    sigma: f64,
    source: NoiseSource,
    degrees: DegreesOfFreedom,
) -> Option<BeyondOrders> {
    let variance = sigma * sigma;
    let highest = groups.iter().map(Group::highest).max().unwrap_or(0);
    // Where the finer half tells the noise it cannot be tested against it.
    let end = match source {
        NoiseSource::BeyondOrders => finer_half(orders, highest),
        _ => highest + 1,
    };
    // Variance σ² in each of two parts under noise alone.
    let powers: Vec<f64> = (orders + 1..end)
        .filter_map(|order| {
            let known = information(groups, order, |_| true)?;
            Some(known * common(groups, steps, order)?.norm_sqr())
        })
        .collect();
    let whole: f64 = powers.iter().sum();
    let freedom = 2.0 * powers.len() as f64;
    let greatest = powers.iter().copied().fold(0.0, f64::max);
    let single = powers.len() as f64 * exceeding(greatest / variance, 2.0, degrees);
    let mut probabilities = vec![single];
    let (mut sum, mut size) = (0.0, 1);
    for (count, power) in (1usize..).zip(&powers) {
        sum += power;
        if count == size || count == powers.len() {
            probabilities.push(exceeding(sum / variance, 2.0 * count as f64, degrees));
            size *= 2;
        }
    }
    let least = probabilities.iter().copied().fold(1.0, f64::min);
    let p_value = (probabilities.len() as f64 * least).min(1.0);
    let readings: f64 = groups.iter().map(Group::weight).sum();
    let rms = ((whole - freedom * variance).max(0.0) / readings).sqrt();
    (p_value < TOLD_BELOW).then_some(BeyondOrders { rms, p_value })
}
