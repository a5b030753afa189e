//! Noise that is correlated along the scans, as repeats tell it.
//!
//! Repeats of a spacing differ by noise, and by a height before and after the joint. Noise of which a part goes on from
//! reading to reading gives the long waves more than the short ones: with variances w of the white part and o of the part
//! that keeps ρ from reading to reading, an order ω of N readings has
//!
//! ```text
//!     r(ω) ∝ w + o (1 − ρ²)/(1 − 2ρ cos(2πω/N) + ρ²)
//! ```
//!
//! times the variance that its parts have on average over the orders.

use rand::Rng;

use super::group::Group;
use super::joint::Joint;
use crate::noise::{Contrasts, Law, Posterior};

/// Noise that is correlated along the scans.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Along {
    /// In units of the mean variance of the orders.
    law: Law,
    /// From reading to reading, mm.
    step: f64,
    samples: usize,
    /// Degrees of freedom of the longest waves.
    pub freedom: f64,
}

impl Along {
    /// What repeats tell; none where they may differ by white noise.
    pub fn of(groups: &[Group], joints: &[Joint], length: f64) -> Option<Self> {
        let mut contrasts = Contrasts::default();
        for g in groups.iter().filter(|g| g.scans.len() > 1) {
            let step = length / g.samples as f64;
            let joint = g.third_from.unwrap_or(g.samples);
            for part in [0..joint, joint..g.samples] {
                let x: Vec<f64> = part.clone().map(|k| k as f64 * step).collect();
                let of = |scan: &usize| joints[*scan].difference[part.clone()].to_vec();
                let repeats: Vec<Vec<f64>> = g.scans.iter().map(of).collect();
                contrasts.add(&x, &repeats, 1.0);
            }
        }
        let laws = Posterior::of(&contrasts).filter(Posterior::is_correlated)?;
        let samples = groups.first()?.samples;
        let step = length / samples as f64;
        let longest = laws.possible().iter();
        let longest = longest.map(|p| p.law.of_wave(step, 1, samples));
        let (_, freedom) = laws.variance(&longest.collect::<Vec<_>>());
        let law = laws.mean();
        let highest = (samples.saturating_sub(1) / 2).max(1);
        let orders = (1..=highest).map(|order| law.of_wave(step, order, samples));
        let mean = orders.sum::<f64>() / highest as f64;
        let law = Law {
            shift: 0.0,
            drift: 0.0,
            ..law.times(1.0 / mean)
        };
        Some(Self {
            law,
            step,
            samples,
            freedom,
        })
    }

    /// Variance of an order over that of all orders on average.
    pub fn of_order(&self, order: usize) -> f64 {
        self.law.of_wave(self.step, order, self.samples)
    }

    /// Variance of a reading over that.
    pub fn of_reading(&self) -> f64 {
        self.law.of_readings()
    }

    /// Variance of a fitted step over that which white noise gives it: the longest waves tell most of it.
    pub fn of_step(&self, group: &Group) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for (order, step) in group.step.iter().enumerate().skip(1) {
            sum += step.norm_sqr() * self.of_order(order);
            all += step.norm_sqr();
        }
        if all > 0.0 { sum / all } else { 1.0 }
    }

    /// Noise of readings at even steps, for a mean variance of the orders of one.
    pub fn draw(&self, random: &mut impl Rng, samples: usize) -> Vec<f64> {
        let positions: Vec<f64> = (0..samples).map(|k| k as f64 * self.step).collect();
        let mut noise = vec![0.0; samples];
        self.law.draw(&positions, random, &mut noise);
        noise
    }

    /// White and correlated standard deviation, in that of the orders on average, and the length, mm.
    pub fn parts(&self) -> (f64, f64, f64) {
        (
            self.law.white.sqrt(),
            self.law.correlated.sqrt(),
            self.law.length,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::TAU;

    /// *Simulated truth*: orders of drawn noise scatter as is said, 400 draws of 200 readings.
    #[test]
    fn orders_have_the_variance_of_the_law() {
        let along = Along {
            law: Law {
                correlated: 0.6,
                length: 2.0,
                ..Law::of_white(0.4)
            },
            step: 0.5,
            samples: 200,
            freedom: 100.0,
        };
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let draws: Vec<Vec<f64>> = (0..400).map(|_| along.draw(&mut random, 200)).collect();
        for order in [1, 7, 30, 90] {
            let variance: f64 = draws
                .iter()
                .map(|noise| {
                    let angle = |k: usize| TAU * (order * k) as f64 / 200.0;
                    let part = |of: fn(f64) -> f64| -> f64 {
                        let terms = noise.iter().enumerate();
                        terms.map(|(k, e)| e * of(angle(k))).sum()
                    };
                    part(f64::cos).powi(2) + part(f64::sin).powi(2)
                })
                .sum::<f64>()
                / (400.0 * 200.0);
            // k·u: 800 squares know it to 5 %; four of them. What goes around at the ends of 200 readings is less.
            let said = along.of_order(order);
            assert!(
                (variance / said - 1.0).abs() < 0.2,
                "{order}: {variance} {said}"
            );
        }
    }
}
