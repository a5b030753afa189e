//! Forms at few positions without repeats are followed, and not smoothed away and told as noise.

use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::simultaneous::{Options, fit};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::plan::{LENGTH, true_forms};

const NOISE: f64 = 0.05;

/// Waves of 1 µm in slide and sides, at 13 positions.
fn plan(seed: u64) -> Plan {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut form = || TrueForm::random_waves(&mut random, 1.0, 1.5 * LENGTH, 12);
    Plan {
        m: form(),
        s_a: form(),
        s_b: form(),
        seed,
        ..Plan::even(0.0, LENGTH, 13, NOISE)
    }
}

/// *Simulated truth*, eight seeds: the noise that is told, in the root mean square, is that of the readings, from eight degrees
/// of freedom each to 9 %, four of which either way are allowed; forms that are smoothed away make it ten times as great. The
/// slide is found within a quarter of a micrometre at each position, five times the noise of a reading, of which four channels
/// leave a half and a spline at few positions takes up nearly all.
#[test]
fn forms_at_few_positions_are_no_noise() {
    let mut squares = 0.0;
    for seed in 1..=8 {
        let plan = plan(seed);
        let (readings, truth) = simulate(&plan, &[]).unwrap();
        let found = fit(&readings, &Options::default()).unwrap();
        squares += found.noise[0].sigma.powi(2) / 8.0;
        let x = &plan.traces[0].positions;
        let slide = &found.forms(x)[0];
        for (x, value) in x.iter().zip(&slide.values) {
            let off = value - true_forms(&truth)[0].at(*x);
            assert!(off.abs() < 0.25, "{seed}: {off} at {x}");
        }
    }
    let noise = squares.sqrt();
    assert!((noise / NOISE - 1.0).abs() < 0.36, "{noise}");
}
