//! Tests of an axis with known truth.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, NormalError};
use serde::{Deserialize, Serialize};

use super::figures::{FigureValues, Profile};
use super::readings::{Direction, Reading};

/// An axis and its test. Deviations are in µm (seconds of arc), positions in mm (degrees).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PositioningSimulation {
    /// First target.
    pub from: f64,
    /// Last target.
    pub to: f64,
    /// Number of targets, evenly spaced; two or more.
    pub targets: usize,
    /// Runs.
    pub runs: u32,
    /// Deviation gained from the first to the last target.
    pub gain: f64,
    /// Amplitude of a deviation that repeats.
    pub periodic: f64,
    /// Its period, in the unit of the positions.
    pub period: f64,
    /// Lost motion: forward approaches stop this much short of backward ones.
    pub lost_motion: f64,
    /// Standard deviation of a reading.
    pub noise: f64,
    /// Drift, in an hour.
    pub drift: f64,
    /// Seconds from one reading to the next.
    pub interval: f64,
}

impl Default for PositioningSimulation {
    fn default() -> Self {
        Self {
            from: 0.0,
            to: 500.0,
            targets: 11,
            runs: 5,
            gain: 8.0,
            periodic: 2.0,
            period: 170.0,
            lost_motion: 3.0,
            noise: 0.5,
            drift: 0.0,
            interval: 10.0,
        }
    }
}

/// What the axis does without noise and drift.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The targets.
    pub targets: Vec<f64>,
    /// The deviations, and the noise as standard deviation at every target.
    pub profile: Profile,
    /// The figures of these.
    pub values: FigureValues,
}

impl PositioningSimulation {
    /// The deviation of an approach.
    fn deviation(&self, target: f64, direction: Direction) -> f64 {
        let along = (target - self.from) / (self.to - self.from);
        let phase = std::f64::consts::TAU * (target - self.from) / self.period;
        let half = 0.5 * self.lost_motion;
        let lost = match direction {
            Direction::Forward => -half,
            Direction::Backward => half,
        };
        self.gain * along + self.periodic * phase.sin() + lost
    }

    fn at(&self, i: usize) -> f64 {
        let last = self.targets.max(2) - 1;
        self.from + (self.to - self.from) * i as f64 / last as f64
    }

    /// The axis without noise and drift.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let targets: Vec<f64> = (0..self.targets).map(|i| self.at(i)).collect();
        let of = |direction| {
            let deviation = |t: &f64| self.deviation(*t, direction);
            Some(targets.iter().map(deviation).collect::<Vec<_>>())
        };
        let profile = Profile {
            mean: Direction::ALL.map(of),
            std: [(); 2].map(|()| Some(vec![self.noise; targets.len()])),
        };
        Truth {
            values: FigureValues::of(&profile),
            targets,
            profile,
        }
    }
}

/// The readings of one seed, in the order in which they are taken: each run forward and back.
///
/// # Errors
/// A noise that is no standard deviation.
pub fn simulate(what: &PositioningSimulation, seed: u64) -> Result<Vec<Reading>, NormalError> {
    let law = Normal::new(0.0, what.noise)?;
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut readings = Vec::new();
    for run in 1..=what.runs {
        for direction in Direction::ALL {
            for k in 0..what.targets {
                let i = match direction {
                    Direction::Forward => k,
                    Direction::Backward => what.targets - 1 - k,
                };
                let target = what.at(i);
                let time = what.interval * readings.len() as f64;
                let drift = what.drift * time / 3600.0;
                let noise = law.sample(&mut generator);
                readings.push(Reading {
                    target,
                    run,
                    direction,
                    deviation: what.deviation(target, direction) + drift + noise,
                    time: Some(time),
                });
            }
        }
    }
    Ok(readings)
}
