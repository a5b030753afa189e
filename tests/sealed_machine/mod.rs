//! Reversals of one machine, set up anew for every measurement, by formulas of their own.
#![allow(dead_code, reason = "tests and campaigns each use their part")]

use std::f64::consts::TAU;

use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::{Channel, Direction, Observations, Reading};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// White noise of a reading, µm.
const NOISE: f64 = 0.05;
/// Length of the travel, mm.
const TRAVEL: f64 = 300.0;

/// What is wrong with a machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    Nothing,
    Taper,
    Gain,
    Drift,
    Curvature,
}

/// All of them.
pub const FAULTS: [Fault; 5] = [
    Fault::Nothing,
    Fault::Taper,
    Fault::Gain,
    Fault::Drift,
    Fault::Curvature,
];

impl Fault {
    /// Its name in the catalogue.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Nothing => None,
            Self::Taper => Some("taper"),
            Self::Gain => Some("gain-mismatch"),
            Self::Drift => Some("thermal-drift"),
            Self::Curvature => Some("indicator-nonlinearity"),
        }
    }
}

/// A machine: what stays the same from one measurement to the next.
#[derive(Clone)]
pub struct Machine {
    pub fault: Fault,
    pub size: f64,
    pub alpha: f64,
    /// Waves of the slide, of side A and of side B: amplitude, µm, cycles over the travel, phase.
    pub forms: [[[f64; 3]; 4]; 3],
}

/// How one measurement is laid out.
#[derive(Clone, Copy)]
pub struct Layout {
    pub positions: usize,
    pub repeats: u32,
    pub both: bool,
}

impl Machine {
    /// A machine by chance.
    pub fn drawn(fault: Fault, random: &mut ChaCha8Rng) -> Self {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let forms = [0; 3].map(|_| {
            [1.0, 2.0, 3.0, 5.0].map(|k| [1.5 * normal() / k, k * (1.0 + 0.1 * normal()), normal()])
        });
        let alpha = 30e-6 * normal();
        let sign = if normal() > 0.0 { 1.0 } else { -1.0 };
        let size = 0.7 + 0.6 * random.random::<f64>();
        Self {
            fault,
            size: sign * size,
            alpha,
            forms,
        }
    }

    /// The forms of the sides have no straight line in common, which is the cone: what they have in common is
    /// even about mid travel.
    fn form(&self, which: usize, x: f64) -> f64 {
        let waves = |which: usize, shift: f64| -> f64 {
            let own = self.forms[which].iter();
            let at = (x - TRAVEL / 2.0) / TRAVEL;
            own.map(|[a, k, phase]| a * (TAU * k * at + shift * phase).cos())
                .sum()
        };
        let odd: f64 = self.forms[1]
            .iter()
            .map(|[a, k, _]| a * (TAU * 0.7 * k * (x / TRAVEL - 0.5)).sin())
            .sum();
        match which {
            0 => waves(0, 1.0),
            1 => waves(1, 0.0) + odd,
            _ => waves(2, 0.0) - odd,
        }
    }

    /// One measurement with set-up and noise of its own; without readings, where it is only planned.
    pub fn measured(&self, layout: Layout, random: Option<&mut ChaCha8Rng>) -> Observations {
        let mut idle = ChaCha8Rng::seed_from_u64(0);
        let planned = random.is_none();
        let random = random.unwrap_or(&mut idle);
        let mut normal = |std: f64| -> f64 {
            let value: f64 = StandardNormal.sample(random);
            std * value
        };
        let (beta, gamma) = (20e-6 + normal(5e-6), normal(20e-6));
        let offsets = [0; 4].map(|_| normal(3.0));
        let mut readings = Vec::new();
        let n = layout.positions;
        let mut time = 0.0;
        for (position, pair) in [[(0, 1.0), (1, -1.0)], [(3, 1.0), (2, -1.0)]]
            .iter()
            .enumerate()
        {
            for repeat in 1..=layout.repeats {
                for backward in [false, true]
                    .into_iter()
                    .take(if layout.both { 2 } else { 1 })
                {
                    for step in 0..n {
                        let k = if backward { n - 1 - step } else { step };
                        let x = TRAVEL * k as f64 / (n - 1) as f64;
                        time += 2.0;
                        for (channel, near) in pair {
                            let p = if position == 0 { 1.0 } else { -1.0 };
                            let side = if *channel == 0 || *channel == 2 { 1 } else { 2 };
                            let slope = near * self.alpha + p * beta + near * p * gamma;
                            let seen = near * self.form(0, x)
                                + self.form(side, x)
                                + 1e3 * slope * x
                                + offsets[*channel];
                            let value = self.read(seen, x, time, *near) + normal(NOISE);
                            readings.push(Reading {
                                channel: Channel::ALL[*channel],
                                repeat,
                                direction: if backward {
                                    Direction::Backward
                                } else {
                                    Direction::Forward
                                },
                                time: Some(time),
                                x,
                                value: if planned { 0.0 } else { value },
                            });
                        }
                    }
                }
            }
        }
        Observations { readings }
    }

    /// The same as the diagnosis sees it.
    pub fn model(&self, layout: Layout, random: Option<&mut ChaCha8Rng>) -> Linearised {
        Linearised::new(&self.measured(layout, random), Assumptions::default()).unwrap()
    }

    /// What the indicator reads of what it sees: near +1, far −1.
    fn read(&self, seen: f64, x: f64, time: f64, near: f64) -> f64 {
        let s = self.size;
        match self.fault {
            Fault::Nothing => seen,
            Fault::Taper => seen + 1e-3 * s * x,
            Fault::Gain => seen * (1.0 + 0.03 * s * f64::from(u8::from(near > 0.0))),
            Fault::Drift if near > 0.0 => seen + 0.6 * s * (1.0 - (-time / 500.0).exp()),
            Fault::Drift => seen + 0.4 * s * (1.0 - (-time / 500.0).exp()),
            Fault::Curvature if near > 0.0 => seen,
            Fault::Curvature => seen + 0.005 * s * seen * seen,
        }
    }
}
