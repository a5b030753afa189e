//! The forms of simulated readings.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A form as a sum of waves less a straight line.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveForm {
    /// Amplitude (µm), wave number (rad/mm), phase (rad).
    waves: Vec<[f64; 3]>,
    /// Height (µm) at 0 and slope (µm/mm) of the line taken out.
    line: [f64; 2],
}

/// Waves in a form.
const WAVES: u32 = 4;

impl WaveForm {
    /// Random waves no shorter than two fifths of the length, without straight-line part over the
    /// positions.
    pub(super) fn random(rng: &mut ChaCha8Rng, rms: f64, length: f64, x: &[f64]) -> Self {
        let share = rms * (2.0 / f64::from(WAVES)).sqrt();
        let waves = (0..WAVES)
            .map(|k| {
                let turns = 0.9 + 0.5 * f64::from(k) + 0.1 * rng.random::<f64>();
                [share, TAU * turns / length, TAU * rng.random::<f64>()]
            })
            .collect();
        let mut form = Self {
            waves,
            line: [0.0; 2],
        };
        let n = x.len() as f64;
        let y: Vec<f64> = x.iter().map(|x| form.at(*x)).collect();
        let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
        let product: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
        let slope = product / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>();
        form.line = [my - slope * mx, slope];
        form
    }

    /// Its value, µm, at a position, mm.
    pub fn at(&self, x: f64) -> f64 {
        let waves = self
            .waves
            .iter()
            .map(|[a, k, phase]| a * (k * x + phase).sin());
        waves.sum::<f64>() - self.line[0] - self.line[1] * x
    }
}
