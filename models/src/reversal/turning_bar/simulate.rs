//! Runs of a turning bar with known truth: waves in place of splines, and the bar as a body that is
//! turned, not as a formula of the angle that the indicator sees.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::run::TurningReading;
use crate::noise::Law;

/// What to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct TurningPlan {
    /// Travel from 0, mm.
    pub length_mm: f64,
    /// Readings, evenly in time.
    pub readings: usize,
    /// Turns of the spindle.
    pub turns: f64,
    /// Turns in a minute, on average.
    pub rpm: f64,
    /// Slide against spindle axis and half cone, rad.
    pub slope_rad: f64,
    /// Eccentricity at mid travel, µm.
    pub eccentricity_um: f64,
    /// γ along and across it, rad.
    pub gamma_rad: [f64; 2],
    /// Ovality of the section: half of the difference of its diameters, µm.
    pub oval_um: f64,
    /// Root mean square of the form of slide and bar, µm.
    pub form_um: f64,
    /// By how much the spindle strays from a steady turn at most, rad.
    pub stray_rad: f64,
    /// Bend of the bar at mid travel, µm.
    pub bend_um: f64,
    /// Jump of the indicator's zero at a third of the run, µm.
    pub jump_um: f64,
    /// Standard deviation of one reading: the white part and the part correlated over `length`, µm, s.
    pub noise: Law,
    /// Whether the angle of the spindle is recorded.
    pub recorded: bool,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Default for TurningPlan {
    fn default() -> Self {
        Self {
            length_mm: 250.0,
            readings: 6000,
            turns: 60.0,
            rpm: 3.0,
            slope_rad: 40e-6,
            eccentricity_um: 12.0,
            gamma_rad: [60e-6, 40e-6],
            oval_um: 0.3,
            form_um: 4.0,
            stray_rad: 0.0,
            bend_um: 0.0,
            jump_um: 0.0,
            noise: Law {
                white: 0.01,
                correlated: 0.04,
                length: 0.8,
                shift: 0.0,
                drift: 0.0,
            },
            recorded: false,
            seed: 1,
        }
    }
}

/// What is true of a simulated run.
#[derive(Debug, Clone, PartialEq)]
pub struct TurningTruth {
    /// Times of the readings, s.
    pub time: Vec<f64>,
    /// Angle of the spindle at each, rad.
    pub theta_rad: Vec<f64>,
    /// By how much it is behind the least-squares line of its angles, rad.
    pub lag_rad: Vec<f64>,
    /// Form at each reading, without its line, µm.
    pub form_um: Vec<f64>,
}

/// Least readings, and most, of a simulated run.
pub const FEWEST: usize = 60;

/// Readings of a plan, and what is true of them.
pub fn simulate(plan: &TurningPlan) -> (Vec<TurningReading>, TurningTruth) {
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    let n = plan.readings.max(FEWEST);
    let span = 60.0 * plan.turns / plan.rpm;
    let time: Vec<f64> = (0..n).map(|i| span * i as f64 / (n - 1) as f64).collect();
    let x: Vec<f64> = time.iter().map(|t| plan.length_mm * t / span).collect();
    let waves: Vec<[f64; 3]> = (0..4)
        .map(|k| {
            let turns = 0.9 + 0.6 * f64::from(k) + 0.2 * rng.random::<f64>();
            [1.0 / f64::from(k + 1), turns, TAU * rng.random::<f64>()]
        })
        .collect();
    let raw = |share: f64| -> f64 {
        waves
            .iter()
            .map(|[a, turns, phase]| a * (TAU * turns * share + phase).sin())
            .sum()
    };
    let form = without_line(&x, x.iter().map(|x| raw(x / plan.length_mm)).collect());
    let scale = plan.form_um / (form.iter().map(|f| f * f).sum::<f64>() / n as f64).sqrt();
    let form: Vec<f64> = form.iter().map(|f| scale * f).collect();
    let phase = TAU * rng.random::<f64>();
    let begin = TAU * rng.random::<f64>();
    let stray = |share: f64| {
        plan.stray_rad * (0.7 * (TAU * 0.8 * share + phase).sin() + 0.3 * (TAU * 2.1 * share).sin())
    };
    let theta: Vec<f64> = (0..n)
        .map(|i| begin + TAU * plan.turns * time[i] / span + stray(time[i] / span))
        .collect();
    let mut noise = vec![0.0; n];
    plan.noise.draw(&time, &mut rng, &mut noise);
    let half = 0.5 * plan.length_mm;
    let readings = (0..n)
        .map(|i| {
            // The axis of the bar, in the bar's own directions, turned with the spindle.
            let along = x[i] - half;
            let bow = plan.bend_um * (1.0 - (along / half).powi(2));
            let own = [
                plan.eccentricity_um + 1e3 * plan.gamma_rad[0] * along,
                1e3 * plan.gamma_rad[1] * along + bow,
            ];
            let (s, c) = theta[i].sin_cos();
            let near = own[0] * c - own[1] * s;
            let radius = plan.oval_um * (2.0 * (theta[i] + 0.4)).cos();
            let jump = if 3 * i > n { plan.jump_um } else { 0.0 };
            let value =
                near + radius + form[i] + 1e3 * plan.slope_rad * x[i] + jump + noise[i] + 50.0;
            TurningReading {
                time: Some(time[i]),
                x: x[i],
                value,
                // Clockwise from the indicator's side of the bar: see ψ = φ − θ.
                spindle: plan.recorded.then(|| theta[i].to_degrees()),
            }
        })
        .collect();
    let lag_rad = without_line(&time, theta.clone())
        .iter()
        .map(|l| -l)
        .collect();
    let truth = TurningTruth {
        time,
        lag_rad,
        theta_rad: theta,
        form_um: form,
    };
    (readings, truth)
}

/// Values less their least-squares line.
fn without_line(x: &[f64], y: Vec<f64>) -> Vec<f64> {
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let product: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
    let slope = product / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>();
    x.iter()
        .zip(y)
        .map(|(x, y)| y - my - slope * (x - mx))
        .collect()
}
