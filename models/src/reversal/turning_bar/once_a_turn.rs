//! The once-per-turn wave of a run by itself, for traces at two angles: its speed, where it is highest, and
//! its amplitude, whatever the bar is.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::error::TurningError;
use super::fit::{fit, steady};
use super::possible::Possible;
use super::problem::{ECCENTRICITY, Held, SPEED, THETA};
use super::run::Run;
use super::setting::{Along, Setting, Wave};
use super::spread::{Slow, Spread};
use super::start::Survey;
use crate::noise::Law;

/// Cells of all that is slow.
const BACKGROUND_CELLS: usize = 6;
/// Steps of the phase at the ends of the run in the search for the speed, rad, and how far it goes.
const STEP: f64 = 0.1;
/// See [`STEP`].
const REACH: f64 = 6.0 * PI;

/// The once-per-turn wave of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnceATurn {
    /// Turns of the wave in a second, and their standard uncertainty in white noise.
    pub frequency: (f64, f64),
    /// Turns of the spindle in a second, and their standard uncertainty: the direction of a bar that is inclined turns along
    /// it, and the wave with that.
    pub of_spindle: (f64, f64),
    /// By how much the wave of a turn strays from a steady turn, rad.
    pub unsteadiness: f64,
    /// Time at which the wave is highest, nearest the middle of the run.
    pub highest_at: f64,
    /// Amplitude in the middle, µm.
    pub amplitude: f64,
    /// Second harmonic of the section in the middle, a + ib of a cos 2ψ + b sin 2ψ, ψ from the direction in which the bar runs
    /// out, µm.
    pub oval: Complex<f64>,
    /// Standard deviation of what background, wave and second harmonic leave, µm.
    pub rest: f64,
}

/// The wave of a run that turns steadily.
///
/// Its speed is that of a wave of steady amplitude: a run-out that turned evenly along the artefact could
/// not be told from a little more or less speed, and would leave the speed undetermined. Amplitude and
/// phase are then those of a straight bar at that speed.
///
/// # Errors
/// [`TurningError`]: nothing turns, or too few turns.
pub fn once_a_turn(run: &Run, about_hz: Option<f64>) -> Result<OnceATurn, TurningError> {
    let mut survey = Survey::new(run, 0.0, 1.0, about_hz)?;
    let surveyed = survey.clone();
    // In the middle a wave that goes out of step along the run is not lost.
    survey.frame.reference_mm = middle_of(run);
    let survey = survey;
    let even = Setting {
        harmonics: vec![2],
        along: Along::Constant,
        growing: false,
        form_cells: BACKGROUND_CELLS,
        wave: Wave::Steady,
        ..Setting::default()
    };
    let (speed, mean) = coherent(&survey);
    let wave = fit(run, &survey, &even, Held::default(), &|_, at| {
        at.border[THETA] = mean.arg();
        at.border[SPEED] = speed;
        at.border[ECCENTRICITY] = mean.norm();
    })?;
    let growing = Setting {
        growing: true,
        along: Along::Linear,
        ..even
    };
    let hold = Held {
        speed: true,
        ..Held::default()
    };
    let bar = fit(run, &survey, &growing, hold, &|_, at| {
        for j in [THETA, SPEED, ECCENTRICITY] {
            at.border[j] = wave.at.border[j];
        }
    })?;
    // What the wave's growth leaves in the first fit is no noise: that of the second is.
    let noise = Law::of_white(bar.squares / bar.freedom());
    let frequency = wave.speed(survey.base_hz, &Spread::new(&wave, &noise, Slow::default()));
    let straight = steady(run, &surveyed, bar.setting())?;
    let possible = Possible::of_fit(
        run,
        &surveyed,
        &straight,
        (&noise, Slow::default(), 1.0),
        false,
    );
    let of_spindle = possible
        .speed(surveyed.base_hz)
        .map_or((frequency.value, f64::INFINITY), |told| {
            (told.value, told.std)
        });
    let spread = Spread::new(&bar, &noise, Slow::default());
    let oval = (bar.harmonics(&spread).iter().find(|h| h.k == 2)).map(|h| h.middle);
    let middle = survey.frame.middle;
    let direction = bar.axis_direction(middle_of(run));
    // Highest where ψ = −θ is the direction of the run-out.
    let ahead = (-direction - bar.at.border[THETA] + PI).rem_euclid(TAU) - PI;
    Ok(OnceATurn {
        frequency: (frequency.value, frequency.std),
        of_spindle,
        unsteadiness: surveyed.unsteadiness(noise.variance(), run.len()),
        highest_at: middle + ahead / (TAU * frequency.value),
        amplitude: bar.amplitude(middle_of(run)),
        oval: oval.unwrap_or_default(),
        rest: (bar.squares / bar.freedom()).sqrt(),
    })
}

fn middle_of(run: &Run) -> f64 {
    let (low, high) = run.range();
    f64::midpoint(low, high)
}

/// The speed, as ω', at which the waves of all turns add up to most, and their mean there.
fn coherent(survey: &Survey) -> (f64, Complex<f64>) {
    let mean = |speed: f64| -> Complex<f64> {
        let waves = survey.waves.iter();
        let back = |t: f64| Complex::from_polar(1.0, -speed * survey.frame.tau(t));
        waves.map(|w| w.z * back(w.time)).sum::<Complex<f64>>() / survey.waves.len() as f64
    };
    let count = (REACH / STEP) as i32;
    (-count..=count)
        .map(|k| STEP * f64::from(k))
        .map(|speed| (speed, mean(speed)))
        .max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))
        .unwrap_or((0.0, Complex::new(0.0, 0.0)))
}
