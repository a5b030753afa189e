//! One kernel of the structured fit, run a number of times: what `benches/instructions.sh` counts
//! the instructions of.
//!
//! `cargo run --release -p errsep-campaigns --bin kernels -- <kernel> <times> [readings a channel]`

use std::hint::black_box;

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::simultaneous::{
    self, Axis, ChannelReadings, Knots, Noise, Options, Reversal, Thickness, Unknowns, fit,
};
use errsep_models::reversal::{Channel, Convention, Observations};
use errsep_solvers::linear::banded::{Tall, compress};
use errsep_solvers::linear::bordered::{Bordered, BorderedCovariance, Constraints, Group, Share};
use errsep_solvers::structured::evaluate;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const LENGTH: f64 = 300.0;
const THICKNESS: f64 = 42.0;
const CELLS: usize = 61;
const KERNELS: &str = "compress, fold, solve, splines, pass, fit, fit-by-channel";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let usage = format!("usage: kernels <{KERNELS}> <times> [readings a channel]");
    let kernel = arguments.next().ok_or(usage.clone())?;
    let times: usize = arguments.next().ok_or(usage.clone())?.parse()?;
    let n = arguments.next().map_or(Ok(500), |text| text.parse())?;
    match kernel.as_str() {
        "compress" => compressing(times),
        "fold" => folding(times),
        "solve" => solving(times),
        "splines" => splines(times)?,
        "pass" => passes(times, n)?,
        "fit" => fits(times, n, Noise::Equal)?,
        "fit-by-channel" => fits(times, n, Noise::Estimated)?,
        _ => return Err(usage.into()),
    }
    Ok(())
}

/// Some number without pattern between −1 and 1.
fn value(i: usize) -> f64 {
    (i as f64 * 12.9898).sin()
}

/// A full batch of ten columns, on an empty triangle.
fn compressing(times: usize) {
    let mut from = Tall::new(10);
    from.reset(Tall::CAPACITY, 10);
    for j in 0..10 {
        for (i, out) in from.column_mut(j).iter_mut().enumerate() {
            *out = value(10 * i + j);
        }
    }
    let mut batch = from.clone();
    for _ in 0..times {
        for j in 0..10 {
            batch.column_mut(j).copy_from_slice(from.column(j));
        }
        let mut triangle = vec![0.0; 100];
        compress(&mut batch, &mut triangle);
        black_box(triangle);
    }
}

/// Groups of eight columns in a band of 183 unknowns of three kinds, fourteen in the border.
fn groups() -> Vec<Group> {
    (0..CELLS - 3)
        .map(|cell| Group {
            band: (0..4)
                .flat_map(|k| [Some(3 * (cell + k)), Some(3 * (cell + k) + 1 + cell % 2)])
                .collect(),
            border: (0..14)
                .map(|unknown| Share {
                    column: unknown % 9,
                    unknown,
                    weight: value(unknown as usize + 1),
                })
                .collect(),
            columns: 10,
            part: 0,
            triangle: (0..100)
                .map(|at| {
                    if at % 10 < at / 10 {
                        0.0
                    } else {
                        value(at + cell)
                    }
                })
                .collect(),
            cost: 0.0,
        })
        .collect()
}

fn assembled(groups: &[Group]) -> Bordered {
    let mut system = Bordered::new(3 * CELLS, 12, 14);
    for group in groups {
        system.absorb(group, 1.0);
    }
    system.finish();
    system
}

fn folding(times: usize) {
    let groups = groups();
    for _ in 0..times {
        black_box(assembled(&groups));
    }
}

fn solving(times: usize) {
    let system = assembled(&groups());
    let constraints = Constraints {
        band: (0..6)
            .map(|l| (0..3 * CELLS).map(|i| value(6 * i + l)).collect())
            .collect(),
        border: DMatrix::from_fn(6, 14, |i, j| value(i + 6 * j)),
        value: DVector::zeros(6),
    };
    for _ in 0..times {
        let solved = system.solve(&constraints, &DVector::zeros(6), &[false; 14]);
        black_box(
            solved
                .map(|solved| BorderedCovariance::new(&system, &solved))
                .ok(),
        );
    }
}

fn splines(times: usize) -> Result<(), Box<dyn std::error::Error>> {
    let basis = CubicBSpline::uniform(0.0, LENGTH, CELLS)?;
    let coefficients: Vec<f64> = (0..basis.coefficient_count()).map(value).collect();
    for _ in 0..times {
        for i in 0..1000 {
            black_box(basis.evaluate(&coefficients, 0.3 * i as f64));
        }
    }
    Ok(())
}

fn readings(n: usize) -> Result<(Observations, CubicBSpline), Box<dyn std::error::Error>> {
    let basis = CubicBSpline::uniform(0.0, LENGTH, CELLS)?;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut plan = Plan::even(0.0, LENGTH, n, 0.02);
    plan.m = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_a = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_b = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (120e-6, -80e-6, 900e-6);
    plan.thickness_mm = THICKNESS;
    Ok((simulate(&plan, &[])?.0, basis))
}

/// One pass over all readings: rows made, compressed and folded.
fn passes(times: usize, n: usize) -> Result<(), Box<dyn std::error::Error>> {
    let (observations, basis) = readings(n)?;
    let channels = ChannelReadings::sort(&observations);
    let unknowns = Unknowns::new(Channel::ALL.to_vec(), Convention::Seed, false, CELLS + 3);
    let axis = Axis::of(&channels).ok_or("all positions are equal")?;
    let lines = simultaneous::lines(&channels)?;
    let tilts = simultaneous::tilts(&unknowns, &lines);
    let at = simultaneous::start(&unknowns, &tilts, &lines, THICKNESS);
    let problem = Reversal::new(
        &channels,
        unknowns,
        vec![basis; 3],
        axis,
        THICKNESS,
        vec![1.0; 4],
    );
    for _ in 0..times {
        black_box(evaluate(&problem, &at)?);
    }
    Ok(())
}

fn fits(times: usize, n: usize, noise: Noise) -> Result<(), Box<dyn std::error::Error>> {
    let (observations, basis) = readings(n)?;
    let options = Options {
        thickness: Thickness::Known(THICKNESS),
        noise,
        knots: Knots::At(basis.breaks().to_vec()),
        ..Options::default()
    };
    for _ in 0..times {
        black_box(fit(&observations, &options)?);
    }
    Ok(())
}
