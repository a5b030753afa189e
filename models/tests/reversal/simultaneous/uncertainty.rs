//! Errors as large as stated, under gaps, repeats, unequal noise and outliers.

use errsep_models::reversal::simulate::{even_grid, simulate};
use errsep_models::reversal::simultaneous::{Noise, Simultaneous, Thickness, fit, monte_carlo};
use errsep_solvers::loss::Loss;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::plan::*;

#[test]
fn uneven_traces_gaps_repeats_and_unequal_noise_stay_within_the_stated_uncertainty() {
    let (mut plan, basis) = spline_plan(10, 100, 0.02, 7);
    plan.repeats = 2;
    plan.both_directions = true;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (c, trace) in plan.traces.iter_mut().enumerate() {
        trace.noise = [0.01, 0.02, 0.05, 0.1][c];
        trace.positions = even_grid(0.0, LENGTH, 80 + 13 * c);
        for x in &mut trace.positions {
            *x += rng.random_range(0.0..0.5);
        }
        if c == 1 {
            trace.positions.retain(|x| !(100.0..160.0).contains(x));
        }
    }
    let (observations, truth) = simulate(&plan, &[]).unwrap();
    let solution = fit(&observations, &options(&basis, 42.0, Noise::Estimated)).unwrap();
    for (name, value) in truths(&truth) {
        let found = tilt(&solution, name);
        // k·u: four standard uncertainties of a fixed seed.
        assert!(
            (found.value - value).abs() < 4.0 * found.std,
            "{name}: {found:?} {value}"
        );
    }
    for (noise, trace) in solution.noise.iter().zip(&plan.traces) {
        let relative = noise.sigma / trace.noise - 1.0;
        // k·u: contrasts of two repeats in two directions, of which neighbours keep half.
        let freedom = 0.5 * 2.0 * trace.positions.len() as f64;
        let limit = 4.0 / (2.0 * freedom).sqrt();
        assert!(relative.abs() < limit, "{noise:?}");
    }
    let freedom: f64 = solution.noise.iter().map(|n| n.degrees_of_freedom).sum();
    // Readings less unknowns: 3 × 11 coefficients, 3 tilts, 4 offsets.
    let unknowns = observations.readings.len() as f64 - freedom;
    assert!((unknowns - 40.0).abs() < 1e-6, "{unknowns}");
    for (profile, form) in solution
        .forms(&even_grid(2.0, 298.0, 40))
        .iter()
        .zip(true_forms(&truth))
    {
        for ((x, value), u) in profile.x.iter().zip(&profile.values).zip(&profile.std) {
            // k·u: 120 comparisons with one seed.
            assert!(
                (value - form.at(*x)).abs() < 5.0 * u,
                "{} at {x}",
                profile.name
            );
        }
    }
}

#[test]
fn the_thickness_is_found_where_tilt_and_form_are_large() {
    let (mut plan, basis) = spline_plan(20, 200, 0.01, 8);
    plan.gamma_rad = 30e-3;
    let (observations, _) = simulate(&plan, &[]).unwrap();
    let mut options = options(&basis, 0.0, Noise::Estimated);
    options.thickness = Thickness::Fitted(20.0);
    let found = fit(&observations, &options).unwrap().thickness();
    // k·u.
    assert!((found.value - 42.0).abs() < 4.0 * found.std, "{found:?}");
    assert!(found.std < 2.0, "{found:?}");
}

#[test]
fn outliers_do_not_count_under_a_robust_loss() {
    let (mut plan, basis) = spline_plan(10, 200, 0.02, 10);
    plan.outlier_share = 0.03;
    plan.outlier_size = 50.0;
    let (observations, truth) = simulate(&plan, &[]).unwrap();
    assert!(!truth.outliers.is_empty());
    let mut options = options(&basis, 42.0, Noise::Estimated);
    let plain = fit(&observations, &options).unwrap();
    options.loss = Loss::Huber { scale: 1.345 };
    let robust = fit(&observations, &options).unwrap();
    let worst = |solution: &Simultaneous| {
        solution
            .forms(&even_grid(0.0, LENGTH, 60))
            .iter()
            .zip(true_forms(&truth))
            .flat_map(|(p, f)| {
                p.x.iter()
                    .zip(&p.values)
                    .map(|(x, v)| (v - f.at(*x)).abs())
                    .collect::<Vec<_>>()
            })
            .fold(0.0, f64::max)
    };
    let (with, without) = (worst(&plain), worst(&robust));
    assert!(without < 0.5 * with, "{without} and {with}");
    for noise in &robust.noise {
        // The median sees the 97 % that are no outliers: a few per cent more than their 0.02.
        assert!((0.018..0.025).contains(&noise.sigma), "{noise:?}");
    }
}

#[test]
fn trials_give_the_uncertainty_of_the_covariance() {
    let (plan, basis) = spline_plan(8, 60, 0.05, 11);
    let (observations, _) = simulate(&plan, &[]).unwrap();
    let solution = fit(&observations, &options(&basis, 42.0, Noise::Estimated)).unwrap();
    let x = [0.0, 77.0, 150.0, 300.0];
    let trials = 400;
    let spread = monte_carlo(&solution, &observations, &x, trials, 5).unwrap();
    // k·u: the standard deviation of n trials has a relative deviation of 1/√(2n); four of them.
    let limit = 4.0 / (2.0 * trials as f64).sqrt();
    for (found, stated) in spread.tilts.iter().zip(solution.tilts()) {
        assert!(
            (found.std / stated.angle.std - 1.0).abs() < limit,
            "{found:?} {stated:?}"
        );
    }
    for (found, stated) in spread.forms.iter().zip(solution.forms(&x)) {
        for (found, stated) in found.iter().zip(&stated.std) {
            assert!(
                (found.std / stated - 1.0).abs() < limit,
                "{found:?} {stated}"
            );
        }
    }
}

#[test]
fn over_many_seeds_errors_are_as_large_as_stated() {
    let seeds = 150;
    let (mut squares, mut inside, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..seeds {
        let (plan, basis) = spline_plan(6, 50, 0.05, 1000 + seed);
        let (observations, truth) = simulate(&plan, &[]).unwrap();
        let solution = fit(&observations, &options(&basis, 42.0, Noise::Estimated)).unwrap();
        for (name, value) in truths(&truth) {
            let found = tilt(&solution, name);
            let z = (found.value - value) / found.std;
            squares += z * z;
            inside += f64::from(u8::from(z.abs() < 1.959_964));
            count += 1.0;
        }
    }
    // k·u: 450 independent values; four standard deviations of their mean square and of a share.
    let rms = f64::sqrt(squares / count);
    assert!((rms - 1.0).abs() < 4.0 / f64::sqrt(2.0 * count), "{rms}");
    let share = inside / count;
    assert!(
        (share - 0.95).abs() < 4.0 * f64::sqrt(0.95 * 0.05 / count),
        "{share}"
    );
}
