//! The staged solution against the simultaneous one, on data of known truth.
//!
//! `cargo run --release -p errsep-campaigns --bin reversal_staged_against_global [SEEDS]`
//!
//! Each line changes one thing of a base case (4 × 151 readings over 300 mm, forms of 1 µm with waves
//! down to 37 mm, tilts of 100 µrad, 40 mm thick, 20 nm noise). Errors are root mean squares over
//! seeds; those of forms over positions too, less their straight line. Knots are chosen from the
//! data. `it`: most iterations over the seeds from the staged seed to the minimum.

use std::time::Instant;

use errsep_models::reversal::simulate::{GaugedForm, Plan, TrueForm, even_grid, simulate};
use errsep_models::reversal::simultaneous::{Options, Thickness, fit};
use errsep_models::reversal::staged;
use errsep_solvers::loss::Loss;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Change = Box<dyn Fn(&mut Plan, &mut ChaCha8Rng)>;

struct Case {
    name: &'static str,
    change: Change,
    robust: bool,
}

fn case(name: &'static str, change: impl Fn(&mut Plan, &mut ChaCha8Rng) + 'static) -> Case {
    Case {
        name,
        change: Box::new(change),
        robust: false,
    }
}

fn tilted(plan: &mut Plan, tilt: f64) {
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (tilt, -0.5 * tilt, 1.5 * tilt);
}

fn noisy(plan: &mut Plan, noise: [f64; 4]) {
    for (trace, noise) in plan.traces.iter_mut().zip(noise) {
        trace.noise = noise;
    }
}

fn without(plan: &mut Plan, channel: usize, from: f64, to: f64) {
    plan.traces[channel]
        .positions
        .retain(|x| !(from..to).contains(x));
}

fn cases() -> Vec<Case> {
    let mut cases = vec![
        case("base case", |_, _| ()),
        case("tilt 10 urad", |p, _| tilted(p, 10e-6)),
        case("tilt 1 mrad", |p, _| tilted(p, 1e-3)),
        case("tilt 10 mrad", |p, _| tilted(p, 10e-3)),
        case("tilt 10 mrad, noise 1 nm", |p, _| {
            tilted(p, 10e-3);
            noisy(p, [1e-3; 4]);
        }),
        case("thickness 0", |p, _| p.thickness_mm = 0.0),
        case("thickness 200 mm", |p, _| p.thickness_mm = 200.0),
        case("thickness 200 mm, tilt 10 mrad", |p, _| {
            tilted(p, 10e-3);
            p.thickness_mm = 200.0;
        }),
        case("noise 1 nm", |p, _| noisy(p, [1e-3; 4])),
        case("noise 1 um", |p, _| noisy(p, [1.0; 4])),
        case("noise 20 nm, 1B 200 nm", |p, _| {
            noisy(p, [0.02, 0.2, 0.02, 0.02])
        }),
        case("noise 5, 20, 80, 320 nm", |p, _| {
            noisy(p, [0.005, 0.02, 0.08, 0.32])
        }),
        case("gap of 40 mm in 1A", |p, _| without(p, 0, 120.0, 160.0)),
        case("gaps of 40 mm in 1A and 2B", |p, _| {
            without(p, 0, 60.0, 100.0);
            without(p, 3, 180.0, 220.0);
        }),
        case("shifted grids", |p, _| {
            for (c, trace) in p.traces.iter_mut().enumerate() {
                for x in &mut trace.positions {
                    *x += 0.5 * c as f64;
                }
            }
        }),
        case("grids of 151, 120, 90, 60", |p, _| {
            for (trace, n) in p.traces.iter_mut().zip([151, 120, 90, 60]) {
                trace.positions = even_grid(0.0, 300.0, n);
            }
        }),
        case("jittered grids", |p, rng| {
            for trace in &mut p.traces {
                for x in &mut trace.positions {
                    *x += rng.random_range(-0.8..0.8);
                }
            }
        }),
    ];
    for (name, robust) in [
        ("2 % outliers of 20 sigma", false),
        ("the same, Huber loss", true),
    ] {
        cases.push(Case {
            name,
            change: Box::new(|p, _| p.outlier_share = 0.02),
            robust,
        });
    }
    cases
}

/// Sums of squares of the errors of three tilts (rad) and three forms (µm).
#[derive(Default)]
struct Errors {
    squares: [f64; 6],
    seconds: f64,
    iterations: usize,
}

impl Errors {
    fn add(&mut self, tilts: [f64; 3], x: &[f64], forms: [&[f64]; 3], truth: [&GaugedForm; 3]) {
        for (sum, error) in self.squares.iter_mut().zip(tilts) {
            *sum += error * error;
        }
        for ((sum, values), truth) in self.squares[3..].iter_mut().zip(forms).zip(truth) {
            let errors: Vec<f64> = x
                .iter()
                .zip(values)
                .map(|(x, v)| v - truth.at(*x))
                .collect();
            *sum += mean_square_without_line(x, &errors);
        }
    }

    fn line(&self, name: &str, method: &str, seeds: f64) {
        let of = |k: usize| (self.squares[k] / seeds).sqrt();
        println!(
            "| {name:<32} | {method:<6} | {:>9.4} | {:>9.4} | {:>9.4} | {:>8.2} | {:>8.2} | {:>8.2} | {:>7.2} | {:>2} |",
            1e6 * of(0),
            1e6 * of(1),
            1e6 * of(2),
            1e3 * of(3),
            1e3 * of(4),
            1e3 * of(5),
            1e3 * self.seconds / seeds,
            self.iterations
        );
    }
}

fn mean_square_without_line(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let (center, mean) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (product, spread) = x.iter().zip(y).fold((0.0, 0.0), |(p, s), (x, y)| {
        (p + (x - center) * (y - mean), s + (x - center).powi(2))
    });
    let slope = product / spread;
    let rest = |(x, y): (&f64, &f64)| (y - mean - slope * (x - center)).powi(2);
    x.iter().zip(y).map(rest).sum::<f64>() / n
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(20), |s| s.parse())?;
    println!(
        "root mean square errors over {seeds} seeds: tilts in urad, forms in nm, time in ms\n"
    );
    println!(
        "| case                             | method | alpha     | beta      | gamma     | M        | S_A      | S_B      | ms      |"
    );
    println!(
        "|----------------------------------|--------|-----------|-----------|-----------|----------|----------|----------|---------|"
    );
    for case in cases() {
        let (mut of_staged, mut of_global) = (Errors::default(), Errors::default());
        for seed in 0..seeds {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut plan = Plan::even(0.0, 300.0, 151, 0.02);
            plan.m = TrueForm::random_waves(&mut rng, 1.0, 450.0, 12);
            plan.s_a = TrueForm::random_waves(&mut rng, 1.0, 450.0, 12);
            plan.s_b = TrueForm::random_waves(&mut rng, 1.0, 450.0, 12);
            tilted(&mut plan, 100e-6);
            plan.thickness_mm = 40.0;
            plan.seed = 1000 + seed;
            (case.change)(&mut plan, &mut rng);
            let (observations, truth) = simulate(&plan, &[])?;
            let true_tilts = [truth.alpha_rad, truth.beta_rad, truth.gamma_rad];
            let true_forms = [&truth.m, &truth.s_a, &truth.s_b];

            let began = Instant::now();
            let staged = staged::solve(
                &observations,
                &staged::Options {
                    thickness: Some(plan.thickness_mm),
                    ..staged::Options::default()
                },
            )?;
            of_staged.seconds += began.elapsed().as_secs_f64();
            let tilts = [0, 1, 2].map(|j| staged.tilts[j].angle.value - true_tilts[j]);
            let forms = [0, 1, 2].map(|f| staged.forms[f].values.as_slice());
            of_staged.add(tilts, &staged.x, forms, true_forms);

            let began = Instant::now();
            let global = fit(
                &observations,
                &Options {
                    thickness: Thickness::Known(plan.thickness_mm),
                    loss: if case.robust {
                        Loss::Huber { scale: 1.345 }
                    } else {
                        Loss::Quadratic
                    },
                    ..Options::default()
                },
            )?;
            of_global.seconds += began.elapsed().as_secs_f64();
            of_global.iterations = of_global.iterations.max(global.convergence.first_run);
            let tilts = global.tilts();
            let tilts = [0, 1, 2].map(|j| tilts[j].angle.value - true_tilts[j]);
            let profiles = global.forms(&staged.x);
            let forms = [0, 1, 2].map(|f| profiles[f].values.as_slice());
            of_global.add(tilts, &staged.x, forms, true_forms);
        }
        of_staged.line(case.name, "staged", seeds as f64);
        of_global.line("", "global", seeds as f64);
    }
    Ok(())
}
