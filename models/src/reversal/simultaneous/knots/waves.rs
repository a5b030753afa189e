//! How much noise a form takes up whose neighbours go together.
//!
//! A linear fit with the hat matrix H predicts readings of covariance V and mean variance v with an error that its residuals
//! tell but for 2 tr HV: the penalty of the criterion is 2 tr HV/v in place of two an unknown (Altman, J. Am. Stat. Assoc. 85,
//! 1990, for kernels). A spline on K cells follows about the first K + 2 half waves over the travel; each of them takes up the
//! variance of the noise in it, and all of them more than K + 1 where neighbours go together. The variance is that of the law,
//! not what the fit leaves: what the model misses would make that great, and fine forms dear.

use crate::noise::Law;

/// The noise of one pass over the travel, by its waves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseOfWaves {
    law: Law,
    step: f64,
    readings: usize,
}

impl NoiseOfWaves {
    /// Of passes with so many readings, a step apart.
    pub fn new(law: Law, step: f64, readings: usize) -> Self {
        Self {
            law,
            step,
            readings,
        }
    }

    /// Variance of a reading.
    pub fn variance(&self) -> f64 {
        self.law.of_readings()
    }

    /// Of a law in units of readings by some weights (by channel), the same by other weights.
    #[must_use]
    pub fn in_weights(self, weights: &[f64], other: &[f64]) -> Self {
        let squares = weights.iter().zip(other).map(|(w, o)| (o / w).powi(2));
        let factor = squares.sum::<f64>() / weights.len().max(1) as f64;
        Self {
            law: self.law.times(factor),
            ..self
        }
    }

    /// What a form on so many cells takes up, in variances of a reading, beside one an unknown.
    pub fn more(&self, cells: usize) -> f64 {
        let half_waves = 2..cells + 3;
        let taken = half_waves.map(|k| self.law.of_wave(self.step, k, 2 * self.readings));
        taken.sum::<f64>() / self.law.of_readings() - (cells + 1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// *Limit*, epsilons: of white noise a form takes up one variance an unknown.
    #[test]
    fn white_noise_is_taken_up_by_the_unknown() {
        let waves = NoiseOfWaves::new(Law::of_white(0.3), 0.5, 100);
        for cells in [1, 7, 40] {
            let more = waves.more(cells);
            assert!(more.abs() < 1e-12, "{cells}: {more}");
        }
    }

    /// *Limit*: as many half waves as there are readings hold all their noise, whatever its law; truncation, as the straight line
    /// is left out. Of a few long ones it holds several times as much as of white noise.
    #[test]
    fn all_waves_hold_all_noise() {
        let law = Law {
            white: 0.2,
            correlated: 0.8,
            length: 3.0,
            shift: 0.0,
            drift: 0.0,
        };
        let readings = 2000;
        let waves = NoiseOfWaves::new(law, 0.5, readings);
        let all = waves.more(readings - 3) / readings as f64;
        assert!(all.abs() < 0.02, "{all}");
        // 0.2 + 0.8 (1 + e^(−1/6))/(1 − e^(−1/6)) of a variance each.
        let few = waves.more(10) / 11.0;
        assert!((7.5..8.81).contains(&few), "{few}");
    }
}
