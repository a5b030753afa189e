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
    /// Slope of one set, by what it changes at full scale.
    SetSlope {
        /// Change at full scale.
        at_full: f64,
        /// The set, from 1.
        set: u32,
    },
    /// Drift of the slope, by what it changes at full scale at the end, with its time constant as a part of
    /// the duration.
    SensitivityDrift {
        /// At full scale, at the end.
        drift: f64,
        /// Time constant.
        constant: f64,
    },
    /// Jump of the zero after a part of the duration.
    ZeroJump {
        /// The jump.
        jump: f64,
        /// When.
        moment: f64,
    },
    /// Width of a loop between rising and falling loads, greatest at half of full scale.
    Hysteresis(f64),
}

impl Disturbance {
    /// The names that [`Self::named`] knows.
    pub const NAMES: [&'static str; 11] = [
        "cubic",
        "drift",
        "hysteresis",
        "logarithmic",
        "quadratic",
        "saturation",
        "sensitivity-drift",
        "set-offset",
        "set-slope",
        "square-root",
        "zero-jump",
    ];

    /// A disturbance by the name of its effect and its size; what these leave open is usual: a knee
    /// at a fifth of full scale, a time constant of a third of the duration, the last set, a jump after
    /// 0.55 of it.
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
            "set-slope" => Self::SetSlope {
                at_full: size,
                set: sets,
            },
            "sensitivity-drift" => Self::SensitivityDrift {
                drift: size,
                constant: 1.0 / 3.0,
            },
            "zero-jump" => Self::ZeroJump {
                jump: size,
                moment: 0.55,
            },
            "hysteresis" => Self::Hysteresis(size),
            _ => return None,
        })
    }

    fn response(self, load: f64, moment: f64, set: u32, rises: bool) -> f64 {
        let settled = |constant: f64| {
            let left = |part: f64| (-part / constant).exp();
            (1.0 - left(moment)) / (1.0 - left(1.0))
        };
        let of_set = |own: u32| if own == set { 1.0 } else { 0.0 };
        match self {
            Self::Quadratic(at_full) => at_full * load * load,
            Self::Cubic(at_full) => at_full * load * load * load,
            Self::SquareRoot(at_full) => at_full * load.sqrt(),
            Self::Logarithmic(per_fold) => per_fold * load.ln(),
            Self::Saturation { lost, knee } => lost * (1.0 - (-load / knee).exp()),
            Self::Drift { drift, constant } => drift * settled(constant),
            Self::SetOffset { offset, set } => offset * of_set(set),
            Self::SetSlope { at_full, set } => at_full * load * of_set(set),
            Self::SensitivityDrift { drift, constant } => drift * load * settled(constant),
            Self::ZeroJump { jump, moment: from } if moment > from => jump,
            Self::ZeroJump { .. } => 0.0,
            Self::Hysteresis(width) => {
                let open = 1.0 - (2.0 * load - 1.0).powi(2);
                if rises {
                    -width * open / 2.0
                } else {
                    width * open / 2.0
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
    /// Whether each set goes back through the same loads.
    pub both_directions: bool,
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
    let up = (1..=what.loads).map(|step| (step, true));
    let down = (1..what.loads).rev().map(|step| (step, false));
    let path: Vec<(usize, bool)> = up.chain(down.filter(|_| what.both_directions)).collect();
    let count = path.len() * what.sets as usize;
    let last = count.saturating_sub(1).max(1) as f64;
    let mut readings = Vec::with_capacity(count);
    for set in 1..=what.sets {
        for (step, rises) in &path {
            let load = *step as f64 / what.loads as f64;
            let time = readings.len() as f64;
            let bent: f64 = what
                .disturbances
                .iter()
                .map(|d| d.response(load, time / last, set, *rises))
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
