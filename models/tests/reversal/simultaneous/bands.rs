//! Bands of forms on knots that the data choose: detail that these cut off is in them, and zeros are not taken for noise.

use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::simultaneous::{Knots, Options, fit};
use errsep_models::reversal::staged::{self, solve};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What is measured: positions, noise of a reading, repeats, and by how much each repeat is zeroed anew, µm.
struct Case {
    positions: usize,
    noise_um: f64,
    repeats: u32,
    zeros_um: f64,
}

/// Part of the places in which a form of waves, which no spline is, lies within 1.96 standard uncertainties, number of places,
/// and root mean square of the errors, µm.
fn within(case: &Case, seeds: u64) -> [f64; 3] {
    let (mut inside, mut count, mut squares) = (0.0, 0.0, 0.0);
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut plan = Plan::even(0.0, 300.0, case.positions, case.noise_um);
        for form in [&mut plan.m, &mut plan.s_a, &mut plan.s_b] {
            *form = TrueForm::random_waves(&mut random, 1.0, 450.0, 12);
        }
        (plan.seed, plan.repeats) = (seed, case.repeats);
        let (mut observations, truth) = simulate(&plan, &[]).unwrap();
        for reading in &mut observations.readings {
            let zero = f64::from(7 * reading.repeat + 5 * reading.channel as u32).sin();
            reading.value += case.zeros_um * zero;
        }
        let options = Options {
            knots: Knots::Chosen,
            ..Options::default()
        };
        let solution = fit(&observations, &options).unwrap();
        let x: Vec<f64> = (0..9).map(|k| 300.0 / 8.0 * f64::from(k)).collect();
        let forms = [("M", &truth.m), ("S_A", &truth.s_a), ("S_B", &truth.s_b)];
        for profile in solution.forms(&x) {
            let (_, form) = forms.iter().find(|f| f.0 == profile.name).unwrap();
            for ((x, value), std) in x.iter().zip(&profile.values).zip(&profile.std) {
                inside += f64::from(u8::from((value - form.at(*x)).abs() < 1.97 * std));
                squares += (value - form.at(*x)).powi(2);
                count += 1.0;
            }
        }
    }
    [inside / count, count, f64::sqrt(squares / count)]
}

#[test]
fn what_chosen_knots_cut_off_is_in_the_bands() {
    for (positions, noise_um) in [(61, 0.05), (31, 0.05), (61, 1.0), (31, 0.3)] {
        let case = Case {
            positions,
            noise_um,
            repeats: 1,
            zeros_um: 0.0,
        };
        let [share, count, _] = within(&case, 120);
        // k·u: neighbouring places share cells, so that half of them count; four standard deviations.
        let off = 4.0 * f64::sqrt(0.95 * 0.05 / (count / 2.0));
        assert!(
            share > 0.95 - off,
            "{positions} positions, {noise_um} µm: {share}"
        );
    }
}

#[test]
fn a_zero_of_each_repeat_hides_no_detail() {
    let alike = |zeros_um| Case {
        positions: 61,
        noise_um: 0.05,
        repeats: 4,
        zeros_um,
    };
    let [_, _, plain] = within(&alike(0.0), 10);
    let [share, _, zeroed] = within(&alike(3.0), 10);
    // Forms know nothing of zeros; the knots differ by a rung here and there.
    assert!(zeroed < 1.2 * plain, "{zeroed} µm, {plain} µm");
    assert!(share > 0.85, "{share}");
}

/// Repeats that are zeroed anew and end before the others leave no steps: each solution is as good and as sure as where
/// they were zeroed once.
#[test]
fn a_zero_of_each_repeat_leaves_no_steps() {
    let mut plan = Plan::even(0.0, 300.0, 61, 0.05);
    (plan.m, plan.s_a, plan.s_b) = (wave(130.0), wave(90.0), wave(210.0));
    (plan.repeats, plan.seed) = (4, 11);
    let (mut observations, truth) = simulate(&plan, &[]).unwrap();
    // Each repeat of a channel lacks a stretch of its own.
    observations.readings.retain(|r| {
        let from = 60.0 * f64::from((3 * r.repeat + r.channel as u32) % 5);
        r.x < from || r.x > from + 25.0
    });
    let off = |zeros_um: f64| {
        let mut zeroed = observations.clone();
        for reading in &mut zeroed.readings {
            let zero = f64::from(7 * reading.repeat + 5 * reading.channel as u32).sin();
            reading.value += zeros_um * zero;
        }
        let rms = |x: &[f64], values: &[f64]| {
            let pairs = x.iter().zip(values);
            let squares = pairs.map(|(x, v)| (v - truth.m.at(*x)).powi(2));
            f64::sqrt(squares.sum::<f64>() / x.len() as f64)
        };
        let first = solve(&zeroed, &staged::Options::default()).unwrap();
        let all = fit(&zeroed, &Options::default()).unwrap();
        let x: Vec<f64> = (0..61).map(|k| 5.0 * f64::from(k)).collect();
        let of_all = &all.forms(&x)[0];
        let of_first = first.forms.iter().find(|f| f.name == "M").unwrap();
        [
            (rms(&first.x, &of_first.values), of_first.std[30]),
            (rms(&x, &of_all.values), of_all.std[30]),
        ]
    };
    for ((plain, sure), (zeroed, as_sure)) in off(0.0).into_iter().zip(off(3.0)) {
        // Heights from 50 positions are known to 0.007 µm each, beside errors of 0.01 µm.
        assert!(zeroed < 1.5 * plain, "{zeroed} µm, {plain} µm");
        assert!(
            (as_sure / sure - 1.0).abs() < 0.3,
            "{as_sure} µm, {sure} µm"
        );
    }
}

fn wave(length: f64) -> TrueForm {
    TrueForm::Waves(vec![errsep_models::reversal::simulate::Wave {
        amplitude: 1.0,
        wavelength: length,
        phase_rad: 0.4,
    }])
}
