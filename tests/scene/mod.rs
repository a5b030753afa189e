//! A small reversal with known truth, and its diagnosis.
#![allow(dead_code, reason = "tests and campaigns each use their part")]

use errsep::diagnosis::{Diagnosis, Options, diagnose};
use errsep_models::reversal::Observations;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// 60 positions, four repeats, both directions, white noise.
pub fn scene(seed: u64, tilt: f64) -> Scene {
    let noise = SceneNoise {
        white: 0.05,
        ..SceneNoise::default()
    };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    Scene::random(60, 4, tilt, 2.0, noise, &mut random)
}

/// The diagnosis, with effects withheld.
pub fn diagnosed(observations: &Observations, without: &[&str]) -> Diagnosis {
    let model = Linearised::new(observations, Assumptions::default()).unwrap();
    let options = Options {
        draws: 200,
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        ..Options::default()
    };
    diagnose(&model, &options)
}
