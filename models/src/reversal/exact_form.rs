//! True forms of the exact readings.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// A form as a sum of waves and bumps over the travel, µm over mm.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Form {
    /// Amplitude µm, wave number rad/mm, phase rad.
    pub waves: Vec<(f64, f64, f64)>,
    /// Height µm, centre mm, width mm.
    pub bumps: Vec<(f64, f64, f64)>,
    /// A straight line, µm and µm/mm.
    pub line: (f64, f64),
}

impl Form {
    /// A form with decreasing waves of up to `highest` periods over the travel and a few bumps.
    pub fn random(size: f64, travel: f64, highest: u32, random: &mut impl Rng) -> Self {
        let waves = (1..=highest)
            .map(|k| {
                let normal: f64 = StandardNormal.sample(random);
                let amplitude = size * normal / f64::from(k).powf(0.8);
                let number = std::f64::consts::TAU * (f64::from(k) - 0.5 + random.random::<f64>());
                (amplitude, number / travel, 6.3 * random.random::<f64>())
            })
            .collect();
        let bumps = (0..2)
            .map(|_| {
                let normal: f64 = StandardNormal.sample(random);
                (
                    0.5 * size * normal,
                    travel * random.random::<f64>(),
                    travel * (0.04 + 0.06 * random.random::<f64>()),
                )
            })
            .collect();
        Self {
            waves,
            bumps,
            line: (0.0, 0.0),
        }
    }

    /// The same form without its least-squares line over some positions: the line of a form is a
    /// tilt or a cone.
    pub fn level(mut self, positions: &[f64]) -> Self {
        let n = positions.len() as f64;
        let mean = positions.iter().sum::<f64>() / n;
        let height = positions.iter().map(|x| self.at(*x)).sum::<f64>() / n;
        let square: f64 = positions.iter().map(|x| (x - mean).powi(2)).sum();
        let slope = positions
            .iter()
            .map(|x| self.at(*x) * (x - mean))
            .sum::<f64>()
            / square;
        self.line.0 -= height - slope * mean;
        self.line.1 -= slope;
        self
    }

    /// Height at a position, µm.
    pub fn at(&self, x: f64) -> f64 {
        let waves: f64 = self
            .waves
            .iter()
            .map(|(a, k, p)| a * (k * x + p).sin())
            .sum();
        let bumps: f64 = self
            .bumps
            .iter()
            .map(|(h, c, w)| h * (-0.5 * ((x - c) / w).powi(2)).exp())
            .sum();
        waves + bumps + self.line.0 + self.line.1 * x
    }
}
