//! Traces at two opposite spindle angles from one indicator on an artefact that turns while the
//! slide feeds.
//!
//! The reading is F(x) + a once-per-turn wave (the artefact runs out by its eccentricity and tilt)
//! and its harmonics. The wave tells the spindle angle: its frequency is found where a least-squares
//! fit of wave and smooth background leaves least, by the engine of [`turning_bar`](super::turning_bar). Every half turn the indicator sees the opposite
//! side, as in the channels 1A and 2B of the reversal.

use errsep_solvers::linear::limited::svd;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;
use thiserror::Error;

use super::turning_bar::{Run, TurningError, once_a_turn};
use super::{Channel, Direction, Observations, Reading};

/// One sample of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Seconds.
    pub time: f64,
    /// Slide position, mm.
    pub x: f64,
    /// Reading, µm.
    pub value: f64,
}

/// How the spindle turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    /// Turns of the once-per-turn wave in a second.
    pub frequency: f64,
    /// Turns of the spindle in a second: the direction in which a bar runs out turns along it where it is inclined across, and
    /// the wave with it.
    pub spindle: f64,
    /// Its standard uncertainty.
    pub spindle_std: f64,
    /// Time, s, at which the once-per-turn wave is highest, nearest the middle of the run.
    pub highest_at: f64,
    /// Half the run-out in the middle of the run: amplitude of the once-per-turn wave, µm.
    pub amplitude: f64,
    /// Standard uncertainty of the spindle angle at a reading, root mean square over the run, rad.
    pub angle_std_rad: f64,
    /// The same as far as it changes along the run, rad.
    pub stray_rad: f64,
    /// Second harmonic of the section, a + ib of a cos 2ψ + b sin 2ψ, ψ from the direction in which the bar runs out, µm.
    pub oval: Complex<f64>,
    /// Root mean square of what background, wave and its harmonics leave, µm.
    pub rest_rms: f64,
    /// Turns in the run.
    pub turns: f64,
}

/// Standard uncertainty of an angle beyond which none is told: the usual half width of the window in which readings of an
/// angle are taken, 20°.
const TOLD: f64 = 20.0 * TAU / 360.0;

impl Turning {
    /// Standard uncertainty of the wave's frequency as that of the spindle.
    pub fn frequency_std(&self) -> f64 {
        self.spindle_std.hypot(self.spindle - self.frequency)
    }

    /// What an unknown angle adds to the standard uncertainty of the slope that two traces half a turn apart have in common
    /// (α of the reversal), rad: an oval section reads the same on both sides, and turns along the `travel_mm` with the
    /// angle by which the spindle may stray from the wave. As a line in time holds the most of such a stray, it is taken as one.
    pub fn slope_std(&self, angle_rad: f64, travel_mm: f64) -> f64 {
        let turned = self.oval.conj() * Complex::from_polar(1.0, -2.0 * angle_rad);
        let um_per_rad = 2.0 * turned.im.abs();
        um_per_rad * 12f64.sqrt() * self.stray_rad / travel_mm * 1e-3
    }

    /// Whether the spindle stands at about one angle where the wave does. Traces half a turn of the wave apart are about
    /// half a turn of the spindle apart all the same, as it strays slowly.
    pub fn tells_angle(&self) -> bool {
        self.angle_std_rad < TOLD
    }
}

/// Why a run gives no traces.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NoTraces {
    /// Too few samples.
    #[error("{samples} samples are too few: a run of three turns with 20 samples a turn is needed")]
    TooFew {
        /// How many there are.
        samples: usize,
    },
    /// A speed at which a turn has too few samples, or the run too few turns.
    #[error(
        "at {rpm:?} turns a minute the {samples} samples make {turns:?} turns: a run of three turns with 12 samples a turn is needed"
    )]
    Speed {
        /// How many there are.
        samples: usize,
        /// Turns in the run at that speed.
        turns: f64,
        /// The speed, turns a minute.
        rpm: f64,
    },
    /// Times do not grow.
    #[error("sample {index}: times must grow")]
    Time {
        /// Which sample, from 0.
        index: usize,
    },
    /// Nothing turns.
    #[error("no once-per-turn wave stands out of the readings")]
    NoWave,
}

/// Samples a turn needs, and turns a run needs.
const SAMPLES_PER_TURN: f64 = 20.0;
const FEWEST_TURNS: f64 = 3.0;
/// Samples a turn below which the widest window at an angle (60° on either side) has no four of them.
const FEWEST_PER_TURN: f64 = 12.0;

/// Finds how the spindle turned; `about` is a guess of its turns in a second, if there is one.
///
/// # Errors
/// [`NoTraces`].
pub fn find_turning(samples: &[Sample], about: Option<f64>) -> Result<Turning, NoTraces> {
    let n = samples.len();
    let too_few = NoTraces::TooFew { samples: n };
    if (n as f64) < FEWEST_TURNS * SAMPLES_PER_TURN {
        return Err(too_few);
    }
    if let Some(i) = samples.windows(2).position(|w| w[1].time <= w[0].time) {
        return Err(NoTraces::Time { index: i + 1 });
    }
    let span = samples[n - 1].time - samples[0].time;
    let (from, to) = match about {
        Some(f) if !(FEWEST_TURNS..=n as f64 / FEWEST_PER_TURN).contains(&(1.05 * f * span)) => {
            return Err(NoTraces::Speed {
                samples: n,
                turns: (10.0 * f * span).round() / 10.0,
                rpm: 60.0 * f,
            });
        }
        Some(f) => (0.95 * f, 1.05 * f),
        None => (FEWEST_TURNS / span, n as f64 / (SAMPLES_PER_TURN * span)),
    };
    if !(from > 0.0 && from < to) {
        return Err(too_few);
    }
    let time: Vec<f64> = samples.iter().map(|p| p.time).collect();
    // What is slow is a spline in time: where the slide stands does not matter to the wave.
    let run = Run {
        x: time.clone(),
        time,
        timed: true,
        value: samples.iter().map(|p| p.value).collect(),
        angle: None,
        direction: 1.0,
    };
    let wave = once_a_turn(&run, about).map_err(|why| match why {
        TurningError::TooFew { .. }
        | TurningError::TooFewTurns { .. }
        | TurningError::TooFewPerTurn { .. }
        | TurningError::TooManyUnknowns { .. } => too_few,
        _ => NoTraces::NoWave,
    })?;
    // Four standard deviations of the amplitude that noise alone would show.
    let noise = wave.rest * (2.0 / n as f64).sqrt();
    if wave.amplitude.is_nan() || wave.amplitude <= 4.0 * noise {
        return Err(NoTraces::NoWave);
    }
    let (frequency, _) = wave.frequency;
    let (spindle, spindle_std) = wave.of_spindle;
    // What wave and spindle may differ by grows evenly from the middle of the run to either end.
    let apart = (spindle - frequency).hypot(spindle_std) * TAU * span / 12f64.sqrt();
    // A stray of that size may hold a line in time.
    let of_stray = wave.unsteadiness * 12f64.sqrt() / (TAU * span);
    let stray = apart.hypot(wave.unsteadiness);
    Ok(Turning {
        frequency,
        spindle,
        spindle_std: spindle_std.hypot(of_stray),
        highest_at: wave.highest_at,
        amplitude: wave.amplitude,
        angle_std_rad: (noise / wave.amplitude).hypot(stray),
        stray_rad: stray,
        oval: wave.oval,
        rest_rms: wave.rest,
        turns: span * frequency,
    })
}

/// The run as traces of the channels 1A (spindle at `angle_rad` after the wave's highest reading) and
/// 2B (half a turn later).
///
/// Each time the spindle passes one of the angles, the parabola through the samples within
/// `window_rad` on either side gives one reading, at the mean speed of the slide there. A passage
/// with fewer than four samples, or at an end of the run, is left out.
///
/// # Errors
/// [`NoTraces`].
pub fn traces(
    samples: &[Sample],
    turning: &Turning,
    angle_rad: f64,
    window_rad: f64,
) -> Result<Observations, NoTraces> {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err(NoTraces::TooFew { samples: 0 });
    };
    let half_turn = 0.5 / turning.frequency;
    let half_window = window_rad / (TAU * turning.frequency);
    let origin = turning.highest_at + angle_rad / (TAU * turning.frequency);
    let from = ((first.time + half_window - origin) / half_turn).ceil() as i64;
    let to = ((last.time - half_window - origin) / half_turn).floor() as i64;
    let mut readings = Vec::new();
    for k in from..=to {
        let time = origin + k as f64 * half_turn;
        let begin = samples.partition_point(|p| p.time < time - half_window);
        let end = samples.partition_point(|p| p.time <= time + half_window);
        if let Some((x, value)) = passage(&samples[begin..end], time) {
            readings.push(Reading {
                channel: if k.rem_euclid(2) == 0 {
                    Channel::C1A
                } else {
                    Channel::C2B
                },
                repeat: 1,
                direction: Direction::Forward,
                time: Some(time),
                x,
                value,
            });
        }
    }
    if readings.is_empty() {
        return Err(NoTraces::TooFew {
            samples: samples.len(),
        });
    }
    if readings[0].x > readings[readings.len() - 1].x {
        readings
            .iter_mut()
            .for_each(|r| r.direction = Direction::Backward);
    }
    Ok(Observations { readings })
}

/// Position (a line) and reading (a parabola) at a time, by least squares.
fn passage(samples: &[Sample], time: f64) -> Option<(f64, f64)> {
    if samples.len() < 4 {
        return None;
    }
    let scale = samples
        .iter()
        .map(|p| (p.time - time).abs())
        .fold(0.0, f64::max);
    let at = |i: usize| (samples[i].time - time) / scale;
    let fit = |columns: usize, y: fn(&Sample) -> f64| {
        let design = DMatrix::from_fn(samples.len(), columns, |i, j| at(i).powi(j as i32));
        let values = DVector::from_iterator(samples.len(), samples.iter().map(y));
        let solution = svd(design, true, true)?.solve(&values, 1e-12).ok()?;
        solution.get(0).copied()
    };
    Some((fit(2, |p| p.x)?, fit(3, |p| p.value)?))
}
