//! The staged reversal: tilts, closure slope and bands on the forms.
//!
//! Readings come from the exact geometry of `reversal::simulate`; forms are waves, tilts below a
//! tenth of a milliradian. White noise, but for the cases that say otherwise.

use errsep_models::reversal::simulate::{Plan, TrueForm, Truth, even_grid, simulate};
use errsep_models::reversal::staged::{Options, Staged, solve};
use errsep_models::reversal::{Channel, Contrast, Observations};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{Row, Tally};

const LENGTH: f64 = 300.0;
const NOISE_UM: f64 = 0.05;

/// What is done to the plan, and what to the readings.
struct Case {
    name: &'static str,
    repeats: u32,
    is_stated: bool,
    plan: fn(&mut Plan, &mut ChaCha8Rng),
    readings: fn(&mut Observations, &mut ChaCha8Rng),
}

const PLAIN: Case = Case {
    name: "",
    repeats: 1,
    is_stated: false,
    plan: |_, _| (),
    readings: |_, _| (),
};

const CASES: &[Case] = &[
    Case {
        name: "one grid, noise stated",
        is_stated: true,
        ..PLAIN
    },
    Case {
        name: "one grid, noise from the closure",
        ..PLAIN
    },
    Case {
        name: "one grid, two repeats",
        repeats: 2,
        ..PLAIN
    },
    Case {
        name: "four repeats, the slide askew in each pass",
        repeats: 4,
        readings: slide_askew,
        ..PLAIN
    },
    Case {
        name: "one reading at an end missing",
        readings: |o, _| {
            o.readings
                .retain(|r| r.channel != Channel::C2A || r.x > 0.0)
        },
        ..PLAIN
    },
    Case {
        name: "a third of 2A missing",
        readings: |o, _| {
            o.readings
                .retain(|r| r.channel != Channel::C2A || r.x > 100.0)
        },
        ..PLAIN
    },
    Case {
        name: "each channel misses a fifth of its readings at random, two repeats",
        repeats: 2,
        readings: |o, random| o.readings.retain(|_| random.random::<f64>() > 0.2),
        ..PLAIN
    },
    Case {
        name: "different grids",
        plan: different_grids,
        ..PLAIN
    },
    Case {
        name: "different grids, a third of 2A missing, noise stated",
        is_stated: true,
        plan: |plan, random| {
            different_grids(plan, random);
            plan.traces[2].positions.retain(|x| *x > 100.0);
        },
        ..PLAIN
    },
    Case {
        name: "1A ten times as noisy, two repeats",
        repeats: 2,
        plan: |plan, _| plan.traces[0].noise *= 10.0,
        ..PLAIN
    },
    Case {
        name: "correlated noise (white 0.05 µm, Markov 0.05 µm over 15 mm), four repeats",
        repeats: 4,
        readings: add_markov,
        ..PLAIN
    },
];

fn different_grids(plan: &mut Plan, random: &mut ChaCha8Rng) {
    for (c, trace) in plan.traces.iter_mut().enumerate() {
        trace.positions = even_grid(0.0, LENGTH, 90 + 11 * c);
        for x in &mut trace.positions {
            *x += random.random_range(-0.4..0.4);
        }
    }
}

/// Readings follow each other along a trace: a Markov process of 0.05 µm over 15 mm.
fn add_markov(observations: &mut Observations, random: &mut ChaCha8Rng) {
    let mut last: Option<(Channel, u32, f64, f64)> = None;
    for reading in &mut observations.readings {
        let normal: f64 = StandardNormal.sample(random);
        let drawn = match last {
            Some((channel, repeat, x, value))
                if channel == reading.channel && repeat == reading.repeat =>
            {
                let kept = f64::exp(-(reading.x - x).abs() / 15.0);
                kept * value + NOISE_UM * (1.0 - kept * kept).sqrt() * normal
            }
            _ => NOISE_UM * normal,
        };
        last = Some((reading.channel, reading.repeat, reading.x, drawn));
        reading.value += drawn;
    }
}

const QUANTITIES: [&str; 7] = [
    "alpha",
    "beta",
    "gamma",
    "closure slope",
    "M (points)",
    "S_A (points)",
    "S_B (points)",
];

/// Every how many points of a form one is counted.
const POINTS_APART: usize = 7;

fn solved(case: &Case, seed: u64) -> Option<(Plan, Truth, Staged)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // The noise of the plan has the first stream.
    random.set_stream(1);
    let mut plan = Plan::even(0.0, LENGTH, 61, NOISE_UM);
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (40e-6, -15e-6, 25e-6);
    plan.m = TrueForm::random_waves(&mut random, 0.5, LENGTH, 5);
    plan.s_a = TrueForm::random_waves(&mut random, 0.5, LENGTH, 5);
    plan.s_b = TrueForm::random_waves(&mut random, 0.5, LENGTH, 5);
    plan.repeats = case.repeats;
    plan.seed = seed;
    (case.plan)(&mut plan, &mut random);
    let (mut observations, truth) = simulate(&plan, &[]).ok()?;
    (case.readings)(&mut observations, &mut random);
    let options = Options {
        noise: case.is_stated.then_some(NOISE_UM),
        ..Options::default()
    };
    let solution = solve(&observations, &options).ok()?;
    Some((plan, truth, solution))
}

fn tallies(plan: &Plan, truth: &Truth, solution: &Staged) -> Option<[Tally; 7]> {
    let freedom = (solution.noise.degrees_of_freedom).unwrap_or(f64::INFINITY);
    let of_slopes = solution.slope_freedom.unwrap_or(f64::INFINITY);
    let mut tallies = [Tally::default(); 7];
    let tilts = [
        (Contrast::Alpha, plan.alpha_rad),
        (Contrast::Spindle, plan.beta_rad),
        (Contrast::Side, plan.gamma_rad),
    ];
    for (k, (contrast, value)) in tilts.into_iter().enumerate() {
        let found = solution.tilt(contrast)?;
        tallies[k].add(found.value - value, found.std, of_slopes);
    }
    let slope = solution.closure.as_ref()?.slope;
    tallies[3].add(slope.value, slope.std, of_slopes);
    for (k, form) in [&truth.m, &truth.s_a, &truth.s_b].into_iter().enumerate() {
        let found = solution.form(k)?;
        let points = solution.x.iter().zip(&found.values).zip(&found.std);
        for ((x, value), std) in points.step_by(POINTS_APART) {
            tallies[4 + k].add(value - form.at(*x), *std, freedom);
        }
    }
    Some(tallies)
}

/// A line anew in each pass, of 0.3 µm at its ends, which both indicators read from opposite sides.
fn slide_askew(observations: &mut Observations, random: &mut ChaCha8Rng) {
    for first in [true, false] {
        for repeat in 1..=4 {
            let line: f64 = StandardNormal.sample(random);
            for r in &mut observations.readings {
                let is_first = matches!(r.channel, Channel::C1A | Channel::C1B);
                if is_first == first && r.repeat == repeat {
                    r.value += 0.3 * line * r.channel.indicator_sign() * (2.0 * r.x / LENGTH - 1.0);
                }
            }
        }
    }
}

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    for case in CASES {
        let all: Vec<[Tally; 7]> = (0..seeds)
            .into_par_iter()
            .filter_map(|seed| {
                let (plan, truth, solution) = solved(case, seed)?;
                tallies(&plan, &truth, &solution)
            })
            .collect();
        for (k, quantity) in QUANTITIES.into_iter().enumerate() {
            rows.push(Row {
                case: case.name.to_owned(),
                quantity: quantity.to_owned(),
                seeds: all.len() as u64,
                tally: all.iter().fold(Tally::default(), |sum, t| sum.and(t[k])),
            });
        }
    }
    rows
}
