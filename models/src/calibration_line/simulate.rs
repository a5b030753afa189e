//! Readings of a transducer that is not straight, by its response and not by the signatures of the
//! diagnosis.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, NormalError};

use super::CalibrationReading;

/// What the transducer does beside a straight line; sizes in the unit of y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// Deviation at full scale, growing with the square of the load.
    Quadratic(f64),
    /// Deviation at full scale, growing with the cube.
    Cubic(f64),
    /// Part at full scale that follows the square root.
    SquareRoot(f64),
    /// Change for each factor of e in load.
    Logarithmic(f64),
    /// Part of the reading that is used up, with its knee as a part of full scale.
    Saturation {
        /// What is lost far beyond the knee.
        lost: f64,
        /// Knee.
        knee: f64,
    },
    /// Drift over the whole calibration, with its time constant as a part of the duration.
    Drift {
        /// At the end.
        drift: f64,
        /// Time constant.
        constant: f64,
    },
    /// Offset of one set.
    SetOffset {
        /// The offset.
        offset: f64,
        /// The set, from 1.
        set: u32,
    },
}

impl Disturbance {
    /// The names that [`Self::named`] knows.
    pub const NAMES: [&'static str; 7] = [
        "cubic",
        "drift",
        "logarithmic",
        "quadratic",
        "saturation",
        "set-offset",
        "square-root",
    ];

    /// A disturbance by the name of its effect and its size; what these leave open is usual: a knee
    /// at a fifth of full scale, a time constant of a third of the duration, the last set.
    pub fn named(name: &str, size: f64, sets: u32) -> Option<Self> {
        Some(match name {
            "quadratic" => Self::Quadratic(size),
            "cubic" => Self::Cubic(size),
            "square-root" => Self::SquareRoot(size),
            "logarithmic" => Self::Logarithmic(size),
            "saturation" => Self::Saturation {
                lost: size,
                knee: 0.2,
            },
            "drift" => Self::Drift {
                drift: size,
                constant: 1.0 / 3.0,
            },
            "set-offset" => Self::SetOffset {
                offset: size,
                set: sets,
            },
            _ => return None,
        })
    }

    fn response(self, load: f64, moment: f64, set: u32) -> f64 {
        match self {
            Self::Quadratic(at_full) => at_full * load * load,
            Self::Cubic(at_full) => at_full * load * load * load,
            Self::SquareRoot(at_full) => at_full * load.sqrt(),
            Self::Logarithmic(per_fold) => per_fold * load.ln(),
            Self::Saturation { lost, knee } => lost * (1.0 - (-load / knee).exp()),
            Self::Drift { drift, constant } => {
                drift * (1.0 - (-moment / constant).exp()) / (1.0 - (-1.0 / constant).exp())
            }
            Self::SetOffset { offset, set: own } => {
                if own == set {
                    offset
                } else {
                    0.0
                }
            }
        }
    }
}

/// What is calibrated and how.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationSimulation {
    /// Reading at zero and slope.
    pub line: [f64; 2],
    /// Full scale; loads are even steps up to it.
    pub full_scale: f64,
    /// Loads of a set.
    pub loads: usize,
    /// Sets.
    pub sets: u32,
    /// Standard deviation of a reading.
    pub noise: f64,
    /// What is not straight.
    pub disturbances: Vec<Disturbance>,
}

/// The readings of one seed, one second after the other.
///
/// # Errors
/// A noise that is not finite.
pub fn simulate(
    what: &CalibrationSimulation,
    seed: u64,
) -> Result<Vec<CalibrationReading>, NormalError> {
    let noise = Normal::new(0.0, what.noise.abs())?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let last = (what.loads * what.sets as usize).saturating_sub(1).max(1) as f64;
    let mut readings = Vec::with_capacity(what.loads * what.sets as usize);
    for set in 1..=what.sets {
        for step in 1..=what.loads {
            let load = step as f64 / what.loads as f64;
            let time = readings.len() as f64;
            let bent: f64 = what
                .disturbances
                .iter()
                .map(|d| d.response(load, time / last, set))
                .sum();
            let x = load * what.full_scale;
            readings.push(CalibrationReading {
                x,
                y: what.line[0] + what.line[1] * x + bent + noise.sample(&mut random),
                set,
                time: Some(time),
            });
        }
    }
    Ok(readings)
}
