//! Readings that were rounded more coarsely than they scatter.
//!
//! Rounding to whole steps q adds a sawtooth of period q to a reading. Noise of standard deviation σ smooths it: the mean of many
//! repeats is off by a wave for each k = 1, 2, … along the reading y, of period q/k and amplitude
//!
//! A_k = q/(π k) exp(−2 π² k² σ²/q²),
//!
//! of variance s = Σ A_k²/2 over all y, and repeats scatter by σ² + q²/12 − s only (q²/12 is the variance of rounding, GUM F.2.2.1;
//! the sawtooth is of mean zero and, over all y, not correlated with the noise before it). So repeats do not show it. Where in its
//! step a channel stands goes with its offset, which is free: each wave has a phase that is not known, a sine and a cosine of
//! variance A_k²/2 each.

use std::f64::consts::PI;

/// Waves that are told apart by their phase, at most.
const MOST: usize = 4;
/// Waves of this share of the variance are left.
const SLIGHT: f64 = 0.02;
/// Waves of which the variance is made; the rest is less than a thousandth of it.
const WAVES: usize = 600;
/// Rounding matters where repeats have this share of their scatter in common for it.
const MATTERS: f64 = 1e-3;
/// Rounding of the readings themselves, in the greatest of them.
const EXACT: f64 = 1e-9;
/// Steps finer than this, in the greatest reading, are not looked for.
const FINEST: f64 = 1e-6;

/// The step that a channel's readings are rounded to, and their noise before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// µm.
    pub step: f64,
    /// Standard deviation, µm.
    pub noise: f64,
}

/// A wave of the error along the reading.
pub(super) struct Wave {
    /// Standard deviation of its sine and of its cosine, µm.
    pub std: f64,
    /// Angle per reading, rad/µm.
    pub per_um: f64,
}

impl Rounding {
    /// From how much repeats scatter, µm²; `None` where their scatter leaves nothing of the rounding in their mean.
    pub(super) fn of(step: f64, within: f64) -> Option<Self> {
        let (mut low, mut high) = (0.0, within.max(0.0).sqrt());
        let at = |noise: f64| Self { step, noise };
        // Halving to rounding.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let scatter = middle * middle + step * step / 12.0 - at(middle).shared();
            if scatter < within {
                low = middle;
            } else {
                high = middle;
            }
        }
        let found = at(low);
        (found.shared() > MATTERS * within).then_some(found)
    }

    /// Variance of the wave k, µm².
    fn variance(&self, k: usize) -> f64 {
        let k = k as f64;
        let amplitude =
            self.step / (PI * k) * (-2.0 * (PI * k * self.noise / self.step).powi(2)).exp();
        0.5 * amplitude * amplitude
    }

    /// Variance of what repeats have in common, µm².
    pub(super) fn shared(&self) -> f64 {
        (1..=WAVES).map(|k| self.variance(k)).sum()
    }

    /// The greatest waves, and the variance of the others, µm².
    pub(super) fn waves(&self) -> (Vec<Wave>, f64) {
        let whole = self.shared();
        let great = (1..=MOST).take_while(|k| self.variance(*k) >= SLIGHT * whole);
        let waves: Vec<Wave> = great
            .map(|k| Wave {
                std: self.variance(k).sqrt(),
                per_um: 2.0 * PI * k as f64 / self.step,
            })
            .collect();
        let told: f64 = waves.iter().map(|wave| wave.std * wave.std).sum();
        (waves, (whole - told).max(0.0))
    }

    /// Standard deviation of what repeats have in common, µm.
    pub fn std(&self) -> f64 {
        self.shared().sqrt()
    }
}

/// The step of which all values are whole multiples, beside what they have in common. `None` where they are all equal, or nothing
/// but what they were computed to.
pub(super) fn step_of(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let greatest = values.clone().map(f64::abs).fold(0.0, f64::max);
    let first = values.clone().next()?;
    let mut step = 0.0;
    for value in values {
        // Euclid's algorithm.
        let mut rest = (value - first).abs();
        while rest > EXACT * greatest {
            (step, rest) = (rest, step % rest);
            // A remainder of almost the whole is none.
            if step - rest <= EXACT * greatest {
                rest = 0.0;
            }
        }
        if step > 0.0 && step < FINEST * greatest {
            return None;
        }
    }
    (step > 0.0).then_some(step)
}

/// Mean square of what traces of one channel at the same places differ by beside their heights, with its degrees of freedom.
pub(super) fn scatter_within(traces: &[Vec<f64>]) -> (f64, f64) {
    let places = traces.iter().map(Vec::len).min().unwrap_or(0);
    if traces.len() < 2 || places < 2 {
        return (0.0, 0.0);
    }
    let count = traces.len() as f64;
    let height = |trace: &Vec<f64>| trace[..places].iter().sum::<f64>() / places as f64;
    let heights: Vec<f64> = traces.iter().map(height).collect();
    let mut squares = 0.0;
    for k in 0..places {
        let level = || traces.iter().zip(&heights).map(|(t, height)| t[k] - height);
        let mean = level().sum::<f64>() / count;
        squares += level().map(|value| (value - mean).powi(2)).sum::<f64>();
    }
    let freedom = (count - 1.0) * (places as f64 - 1.0);
    (squares / freedom, freedom)
}

/// Mean of scatters by their degrees of freedom; `None` without any.
pub(super) fn pooled(scatters: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let (squares, freedom) = scatters.fold((0.0, 0.0), |(squares, all), (square, freedom)| {
        (squares + square * freedom, all + freedom)
    });
    (freedom > 0.0).then(|| squares / freedom)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    /// *Statistical*, 40 000 readings of four repeats: by how much they scatter and what their means are off by are as the waves say, within
    /// 2 %, and the noise before comes back.
    #[test]
    fn waves_hold_what_rounding_does() {
        let step = 0.5;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for noise in [0.03, 0.1, 0.15] {
            let law = Normal::new(0.0, noise).unwrap();
            let (mut within, mut common) = (0.0, 0.0);
            let count = 10_000;
            for _ in 0..count {
                let y: f64 = random.random_range(-5.0..5.0);
                let mut rounded = || step * ((y + law.sample(&mut random)) / step).round();
                let repeats: Vec<f64> = (0..4).map(|_| rounded()).collect();
                let mean = repeats.iter().sum::<f64>() / 4.0;
                within += repeats.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 3.0;
                // Of two repeats the product holds what they have in common alone.
                common += (repeats[0] - y) * (repeats[1] - y);
            }
            let (within, common) = (within / count as f64, common / count as f64);
            let found = Rounding::of(step, within).unwrap();
            assert!(
                (found.noise / noise - 1.0).abs() < 0.03,
                "{noise}: {found:?}"
            );
            let whole = step * step / 12.0;
            assert!(
                (found.shared() - common).abs() < 0.02 * whole,
                "{noise}: {common}"
            );
        }
    }

    /// *Definition*: steps of half micrometres and of ten-thousandths of an inch, about any zero; readings to all their digits have none.
    #[test]
    fn steps_are_found() {
        let of = |values: &[f64]| step_of(values.iter().copied());
        let halves = of(&[0.3, 1.8, -4.2, 7.3]).unwrap();
        assert!((halves - 0.5).abs() < 1e-9, "{halves}");
        let inches = of(&[2.54, 7.62, -12.7, 25.4, 33.02]).unwrap();
        assert!((inches - 2.54).abs() < 1e-9, "{inches}");
        assert_eq!(of(&[1.0, 1.0]), None);
        assert_eq!(of(&[0.123_456_789, 1.987_654_321, -0.555_111_333]), None);
    }
}
