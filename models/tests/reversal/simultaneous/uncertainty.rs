//! Errors as large as stated, under gaps, repeats, unequal noise and outliers.

use errsep_models::reversal::simulate::{even_grid, simulate};
use errsep_models::reversal::simultaneous::{
    Noise, Options, Simultaneous, Thickness, fit, monte_carlo,
};
use errsep_models::reversal::{Channel, Contrast, Direction, Observations, Reading};
use errsep_solvers::loss::Loss;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

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

/// A surface less its straight line between two places.
fn without_line(form: impl Fn(f64) -> f64, from: f64, to: f64) -> impl Fn(f64) -> f64 {
    let count = 2000;
    let places = (0..count).map(|k| from + (to - from) * (f64::from(k) + 0.5) / f64::from(count));
    let middle = 0.5 * (from + to);
    let (mut sum, mut moment, mut spread) = (0.0, 0.0, 0.0);
    for x in places {
        sum += form(x) / f64::from(count);
        moment += (x - middle) * form(x);
        spread += (x - middle).powi(2);
    }
    move |x| form(x) - sum - moment / spread * (x - middle)
}

/// An artefact without a taper over the stretch that all traces have, read from places and to places of its own by
/// every trace: the closure of the slopes is zero within its uncertainty.
#[test]
fn the_closure_is_as_sure_as_the_ends_of_its_traces() {
    let mut squares = 0.0;
    let seeds = 24;
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noise = Normal::new(0.0, 0.03).unwrap();
        let ends: Vec<[f64; 2]> = (0..8)
            .map(|_| {
                [
                    random.random_range(0.0..6.0),
                    300.0 - random.random_range(0.0..6.0),
                ]
            })
            .collect();
        let from = ends.iter().map(|e| e[0]).fold(0.0, f64::max);
        let to = ends.iter().map(|e| e[1]).fold(300.0, f64::min);
        let slide = |x: f64| 2.0 * (x / 37.0).sin();
        let phase = random.random_range(0.0..6.0);
        let side = |of_a: bool| {
            let size = if of_a { 3.0 } else { 2.5 };
            without_line(move |x| size * (x / 60.0 + phase).cos(), from, to)
        };
        let sides = [side(true), side(false)];
        let mut readings = Vec::new();
        for (trace, [first, last]) in ends.into_iter().enumerate() {
            let channel = Channel::ALL[trace % 4];
            let [indicator, on_a] = [Contrast::Alpha, Contrast::Side].map(|c| c.sign(channel));
            for k in 0..120 {
                let x = first + (last - first) * f64::from(k) / 119.0;
                let seen = indicator * slide(x) + sides[usize::from(on_a < 0.0)](x);
                readings.push(Reading {
                    channel,
                    direction: Direction::Forward,
                    repeat: 1 + trace as u32 / 4,
                    time: None,
                    x,
                    value: seen + noise.sample(&mut random),
                });
            }
        }
        let solution = fit(&Observations { readings }, &Options::default()).unwrap();
        let slope = solution.closure.unwrap().slope.unwrap();
        squares += (slope.value / slope.std).powi(2) / seeds as f64;
    }
    // Statistical: were the deviations normal, chi-squared of 24 degrees of freedom would be beyond 2.45 or below 0.25
    // of them once in 10 000 each; what the ends leave open is uniform, which has shorter tails.
    assert!((0.25..2.45).contains(&squares), "{squares}");
}
