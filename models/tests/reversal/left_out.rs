//! What a tilt means does not depend on which channel lacks a reading: staged and simultaneous.

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::simulate::{Plan, TrueForm, even_grid, simulate};
use errsep_models::reversal::simultaneous::{self, Knots, Noise};
use errsep_models::reversal::staged::{self, Removal, Value};
use errsep_models::reversal::{Channel, Contrast, Observations, Reading};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const LENGTH: f64 = 300.0;
const POSITIONS: usize = 61;
const NOISE: f64 = 0.05;
const CELLS: usize = 10;

fn basis() -> CubicBSpline {
    CubicBSpline::uniform(0.0, LENGTH, CELLS).unwrap()
}

fn plan(seed: u64) -> Plan {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut plan = Plan::even(0.0, LENGTH, POSITIONS, NOISE);
    plan.m = TrueForm::random_spline(&mut random, basis(), 1.0);
    plan.s_a = TrueForm::random_spline(&mut random, basis(), 1.0);
    plan.s_b = TrueForm::random_spline(&mut random, basis(), 1.0);
    plan.alpha_rad = 40e-6;
    plan.beta_rad = -15e-6;
    plan.gamma_rad = 25e-6;
    plan.seed = seed;
    plan
}

fn readings(seed: u64) -> Observations {
    simulate(&plan(seed), &[]).unwrap().0
}

/// α, β, γ.
type Tilts = [Value; 3];

fn staged(observations: &Observations) -> Tilts {
    let options = staged::Options {
        removal: Some(Removal::Shear),
        noise: Some(NOISE),
        ..staged::Options::default()
    };
    let solution = staged::solve(observations, &options).unwrap();
    [Contrast::Alpha, Contrast::Spindle, Contrast::Side].map(|c| solution.tilt(c).unwrap())
}

fn simultaneous(observations: &Observations) -> Tilts {
    let options = simultaneous::Options {
        noise: Noise::Declared(NOISE),
        knots: Knots::At(basis().breaks().to_vec()),
        ..simultaneous::Options::default()
    };
    let solution = simultaneous::fit(observations, &options).unwrap();
    let tilts = solution.tilts();
    ["alpha", "beta", "gamma"].map(|name| tilts.iter().find(|t| t.name == name).unwrap().angle)
}

/// Which readings are left out.
type LeftOut = fn(&Reading, usize) -> bool;

/// One reading at an end: in each of the eight cases that of another channel or end.
fn one_end(reading: &Reading, case: usize) -> bool {
    let end = if case < 4 { 0.0 } else { LENGTH };
    reading.channel.index() == case % 4 && reading.x == end
}

/// The first, middle or last third of a channel.
fn a_third(reading: &Reading, case: usize) -> bool {
    let third = LENGTH / 3.0;
    let from = third * (case / 4 % 3) as f64;
    reading.channel.index() == case % 4 && (from..=from + third).contains(&reading.x)
}

fn without(all: &Observations, case: usize, left_out: LeftOut) -> Observations {
    Observations {
        readings: (all.readings.iter().copied())
            .filter(|r| !left_out(r, case))
            .collect(),
    }
}

/// The weights of the readings in the tilts, by moving one reading after the other.
fn weights(solve: fn(&Observations) -> Tilts, at: &Observations) -> Vec<[f64; 3]> {
    let here = solve(at);
    (0..at.readings.len())
        .map(|i| {
            let mut moved = at.clone();
            moved.readings[i].value += 1.0;
            let there = solve(&moved);
            [0, 1, 2].map(|k| there[k].value - here[k].value)
        })
        .collect()
}

fn norm(weights: &[[f64; 3]], k: usize) -> f64 {
    weights.iter().map(|w| w[k] * w[k]).sum::<f64>().sqrt()
}

/// Root mean squares of z = (α′ − α)/(σ‖w′ − w‖), and the same for β and γ.
fn moved(
    solve: fn(&Observations) -> Tilts,
    left_out: LeftOut,
    cases: usize,
    seeds: u64,
) -> [f64; 3] {
    let exact = readings(0);
    let with = weights(solve, &exact);
    let (mut squares, mut count) = ([0.0; 3], 0.0);
    for case in 0..cases {
        let thin = without(&exact, case, left_out);
        let mut own = weights(solve, &thin).into_iter();
        let stated = solve(&thin);
        let (mut difference, mut kept) = (Vec::new(), Vec::new());
        for (reading, with) in exact.readings.iter().zip(&with) {
            let mut change = with.map(|w| -w);
            if !left_out(reading, case) {
                let without = own.next().unwrap();
                change = [0, 1, 2].map(|k| change[k] + without[k]);
                kept.push(without);
            }
            difference.push(change);
        }
        for k in 0..3 {
            // Truncation: the weights are differences of a slightly curved function.
            let ratio = stated[k].std / (NOISE * norm(&kept, k));
            assert!((ratio - 1.0).abs() < 1e-3, "case {case}, tilt {k}: {ratio}");
        }
        for seed in 0..seeds {
            let all = readings(1 + seed + seeds * case as u64);
            let (full, thin) = (solve(&all), solve(&without(&all, case, left_out)));
            for k in 0..3 {
                let z = (thin[k].value - full[k].value) / (NOISE * norm(&difference, k));
                squares[k] += z * z;
            }
            count += 1.0;
        }
    }
    squares.map(|s| (s / count).sqrt())
}

/// k·u: a root mean square over 600 cases is good to 1/√1200 = 2.9 %; 3.5 u.
fn is_one(rms: [f64; 3], what: &str) {
    for (k, rms) in rms.into_iter().enumerate() {
        assert!((0.9..1.1).contains(&rms), "{what}, tilt {k}: {rms}");
    }
}

#[test]
fn staged_tilts_do_not_move_beyond_their_noise_when_a_reading_at_an_end_is_missing() {
    is_one(moved(staged, one_end, 8, 75), "one at an end");
}

#[test]
fn staged_tilts_do_not_move_beyond_their_noise_when_a_third_of_a_channel_is_missing() {
    is_one(moved(staged, a_third, 12, 50), "a third of a channel");
}

#[test]
fn simultaneous_tilts_do_not_move_beyond_their_noise_when_a_reading_at_an_end_is_missing() {
    is_one(moved(simultaneous, one_end, 8, 75), "one at an end");
}

#[test]
fn simultaneous_tilts_do_not_move_beyond_their_noise_when_a_third_of_a_channel_is_missing() {
    is_one(moved(simultaneous, a_third, 12, 50), "a third of a channel");
}

/// Slope of the line of a true form over the positions from `from` to `to`, µm/mm: an even grid.
fn slope_over(form: &impl Fn(f64) -> f64, x: &[f64]) -> f64 {
    let center = x.iter().sum::<f64>() / x.len() as f64;
    let spread = x.iter().map(|x| (x - center).powi(2)).sum::<f64>();
    x.iter().map(|x| (x - center) * form(*x)).sum::<f64>() / spread
}

#[test]
fn where_every_end_is_missing_the_tilts_are_those_of_the_shorter_range() {
    let inner = &even_grid(0.0, LENGTH, POSITIONS)[1..POSITIONS - 1];
    for (solve, what) in [
        (staged as fn(&Observations) -> Tilts, "staged"),
        (simultaneous, "simultaneous"),
    ] {
        let mut squares = [0.0; 3];
        let seeds = 600;
        for seed in 0..seeds {
            let plan = plan(seed);
            let (all, truth) = simulate(&plan, &[]).unwrap();
            let inside = without(&all, 0, |r, _| r.x == 0.0 || r.x == LENGTH);
            let found = solve(&inside);
            let of_m = slope_over(&|x| truth.m.at(x), inner) * 1e-3;
            let of_sides = slope_over(&|x| truth.s_a.at(x) - truth.s_b.at(x), inner) * 0.5e-3;
            let truths = [
                plan.alpha_rad + of_m,
                plan.beta_rad,
                plan.gamma_rad + of_sides,
            ];
            for k in 0..3 {
                squares[k] += ((found[k].value - truths[k]) / found[k].std).powi(2);
            }
        }
        is_one(squares.map(|s| (s / seeds as f64).sqrt()), what);
    }
}

#[test]
fn a_missing_third_is_not_taken_for_a_taper() {
    let mut squares = 0.0;
    for seed in 0..600 {
        let thin = without(&readings(seed), seed as usize % 12, a_third);
        let options = staged::Options {
            noise: Some(NOISE),
            ..staged::Options::default()
        };
        let slope = staged::solve(&thin, &options)
            .unwrap()
            .closure
            .unwrap()
            .slope;
        squares += (slope.value / slope.std).powi(2);
    }
    is_one([(squares / 600.0_f64).sqrt(); 3], "closure slope");
}

/// A form's height and slope by the trapezoidal rule with half an interval more at either end.
fn line_part(x: &[f64], y: &[f64]) -> (f64, f64) {
    let mut points: Vec<(f64, f64, f64)> = Vec::new();
    for k in 1..x.len() {
        let half = (x[k] - x[k - 1]) / 2.0;
        points.extend([(half, x[k - 1], y[k - 1]), (half, x[k], y[k])]);
    }
    points.extend([points[0], points[points.len() - 1]]);
    let total: f64 = points.iter().map(|p| p.0).sum();
    let center = points.iter().map(|(w, x, _)| w * x).sum::<f64>() / total;
    let height = points.iter().map(|(w, _, y)| w * y).sum::<f64>() / total;
    let turn: f64 = points.iter().map(|(w, x, y)| w * (x - center) * y).sum();
    let spread: f64 = points
        .iter()
        .map(|(w, x, _)| w * (x - center).powi(2))
        .sum();
    (height, turn / spread)
}

#[test]
fn forms_have_no_line_over_uneven_positions_whatever_a_channel_lacks() {
    let mut plan = plan(5);
    let uneven: Vec<f64> = (0..50)
        .map(|k| 6.1 * f64::from(k) * (1.0 + 0.004 * f64::from(k)))
        .collect();
    for trace in &mut plan.traces {
        trace.positions = uneven.clone();
    }
    plan.repeats = 2;
    let (all, _) = simulate(&plan, &[]).unwrap();
    let missing = |r: &Reading, _| {
        (r.channel == Channel::C2A && r.x < 150.0)
            || (r.channel == Channel::C1B && r.x > 300.0 && r.repeat == 2)
    };
    let thin = Observations {
        readings: all
            .readings
            .into_iter()
            .filter(|r| !missing(r, 0))
            .collect(),
    };
    let one = staged::solve(&thin, &staged::Options::default()).unwrap();
    assert_eq!(one.x.len(), 50);
    let all_at_once = simultaneous::fit(&thin, &simultaneous::Options::default()).unwrap();
    for k in 0..3 {
        for (what, values) in [
            ("staged", &one.form(k).unwrap().values),
            ("simultaneous", &all_at_once.forms(&uneven)[k].values),
        ] {
            let (height, slope) = line_part(&uneven, values);
            // Epsilons: some tens of roundings of forms and lines up to 30 µm, over 360 mm.
            assert!(
                height.abs() < 1e-12 && slope.abs() < 1e-14,
                "{what} {k}: {height} {slope}"
            );
        }
    }
}

#[test]
fn traces_of_different_grids_with_a_hole_keep_their_tilts() {
    let mut squares = [0.0; 3];
    let seeds = 600;
    for seed in 0..seeds {
        let mut plan = plan(seed);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for (c, trace) in plan.traces.iter_mut().enumerate() {
            let n = 3 * POSITIONS + 20 * c;
            trace.positions = even_grid(0.0, LENGTH, n);
            for x in &mut trace.positions {
                *x += random.random_range(-0.3..0.3);
            }
            if c == 2 {
                trace.positions.retain(|x| *x > LENGTH / 3.0);
            }
        }
        let (observations, _) = simulate(&plan, &[]).unwrap();
        let truths = [plan.alpha_rad, plan.beta_rad, plan.gamma_rad];
        for (k, found) in staged(&observations).into_iter().enumerate() {
            squares[k] += ((found.value - truths[k]) / found.std).powi(2);
        }
    }
    is_one(
        squares.map(|s| (s / seeds as f64).sqrt()),
        "different grids",
    );
}

#[test]
fn complete_even_grids_give_the_formulas_of_the_contrasts() {
    let all = readings(3);
    let solution = staged::solve(
        &all,
        &staged::Options {
            removal: Some(Removal::Shear),
            noise: Some(NOISE),
            ..staged::Options::default()
        },
    )
    .unwrap();
    let x = even_grid(0.0, LENGTH, POSITIONS);
    let lines = Channel::ALL.map(|c| {
        let y: Vec<f64> = all.of(c).map(|r| r.value).collect();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let slope = slope_over(&|at: f64| y[(at / 5.0).round() as usize], &x);
        let rest = x
            .iter()
            .zip(&y)
            .map(|(x, y)| y - mean - slope * (x - LENGTH / 2.0));
        (slope, rest.collect::<Vec<f64>>())
    });
    let spread: f64 = x.iter().map(|x| (x - LENGTH / 2.0).powi(2)).sum();
    for contrast in [Contrast::Alpha, Contrast::Spindle, Contrast::Side] {
        let signs = Channel::ALL.map(|c| contrast.sign(c) / 4.0);
        let found = solution.tilt(contrast).unwrap();
        let by_hand: f64 = (0..4).map(|c| signs[c] * (lines[c].0 * 1e-3).atan()).sum();
        // Exact limit, to some roundings of slopes of 1e-4.
        assert!((found.value - by_hand).abs() < 1e-18, "{contrast:?}");
        // Exact limit but for cos² of tilts of 1e-4.
        let std = 1e-3 * NOISE / (4.0 * spread).sqrt();
        assert!((found.std / std - 1.0).abs() < 1e-7, "{contrast:?}");
    }
    let weights = [
        [0.25, -0.25, -0.25, 0.25],
        [0.5, 0.0, 0.5, 0.0],
        [0.0, 0.5, 0.0, 0.5],
    ];
    for (form, weights) in weights.iter().enumerate() {
        let norm: f64 = weights.iter().map(|w| w * w).sum();
        for k in 0..x.len() {
            let by_hand: f64 = (0..4).map(|c| weights[c] * lines[c].1[k]).sum();
            let found = solution.form(form).unwrap();
            // Exact limit, to some tens of roundings of readings of 10 µm.
            assert!((found.values[k] - by_hand).abs() < 1e-13);
            let hat = 1.0 / x.len() as f64 + (x[k] - LENGTH / 2.0).powi(2) / spread;
            let std = NOISE * (norm * (1.0 - hat)).sqrt();
            assert!((found.std[k] / std - 1.0).abs() < 1e-12);
        }
    }
}
