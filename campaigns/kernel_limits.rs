//! How near the kernels of the structured fit come to what the machine can do.
//!
//! `cargo run --release -p errsep-campaigns --bin kernel_limits`
//!
//! First the machine, on one thread: fused multiply-adds on registers alone (two operations each), and
//! the speed at which 256 MB are read. Then each kernel: its floating-point operations as counted in
//! `docs/theory/structured-least-squares.md`, over its time. The least time of several runs counts, so
//! that a machine shared with others does little harm.

use std::hint::black_box;
use std::time::Instant;

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::simultaneous::{self, Axis, ChannelReadings, Reversal, Unknowns};
use errsep_models::reversal::{Channel, Convention};
use errsep_solvers::by_processor;
use errsep_solvers::linear::banded::{BandTriangle, RowStack, Tall, compress};
use errsep_solvers::structured::evaluate;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const LENGTH: f64 = 300.0;
const THICKNESS: f64 = 42.0;
const CELLS: usize = 61;
const RUNS: usize = 25;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let peak = peak();
    let bandwidth = bandwidth();
    println!(
        "one thread: {:.1} Gflop/s on registers, {:.1} GB/s read",
        peak / 1e9,
        bandwidth / 1e9
    );
    println!("| kernel | flop | s | Gflop/s | of the peak |");
    println!("|---|---|---|---|---|");
    let row = |name: &str, flop: f64, seconds: f64| {
        println!(
            "| {name} | {flop:.2e} | {seconds:.2e} | {:.1} | {:.0} % |",
            flop / seconds / 1e9,
            100.0 * flop / seconds / peak
        );
    };
    for columns in [8, 10, 16] {
        let (flop, seconds) = compressing(columns);
        row(
            &format!("compress, 128 rows of {columns} columns"),
            flop,
            seconds,
        );
    }
    let (flop, seconds) = folding();
    row("fold, 8 rows of 12 columns, 15 beside", flop, seconds);
    for n in [2_000, 200_000] {
        let readings = 4.0 * n as f64;
        let [seconds, residuals] = pass(n)?;
        // Make 180 and compress 2·10² a reading, fold 4 550 and the border 4 500 a group, of which there are 1.5 a cell.
        let flop = 380.0 * readings + 9_050.0 * 1.5 * 4.0 * CELLS as f64;
        row(
            &format!("one pass over 4 x {n} readings, one thread"),
            flop,
            seconds,
        );
        println!(
            "  {:.1} ns a reading, residuals alone {:.1} ns; its 16 bytes alone would take {:.1} ns from memory",
            1e9 * seconds / readings,
            1e9 * residuals / readings,
            1e9 * 16.0 / bandwidth
        );
    }
    Ok(())
}

/// The least time of several runs, s.
fn least(mut run: impl FnMut()) -> f64 {
    (0..RUNS)
        .map(|_| {
            let began = Instant::now();
            run();
            began.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

const STEPS: usize = 100_000;
const CHAINS: usize = 10;

/// Operations a second of independent chains of fused multiply-adds.
fn peak() -> f64 {
    let mut lanes = [[0.5; 4]; CHAINS];
    let seconds = least(|| chains(black_box(&mut lanes)));
    (2 * 4 * CHAINS * STEPS) as f64 / seconds
}

by_processor! {
    fn chains(lanes: &mut [[f64; 4]; CHAINS]) from chains_generic
}

#[inline(always)]
fn chains_generic<const FMA: bool>(lanes: &mut [[f64; 4]; CHAINS]) {
    let mut own = *lanes;
    for _ in 0..STEPS {
        for chain in &mut own {
            for lane in chain {
                *lane = if FMA {
                    lane.mul_add(0.999_999, 1e-6)
                } else {
                    *lane * 0.999_999 + 1e-6
                };
            }
        }
    }
    *lanes = own;
}

/// Bytes a second read from memory.
fn bandwidth() -> f64 {
    let values = vec![1.0; 32 << 20];
    let mut sum = [0.0; 16];
    let seconds = least(|| add_up(black_box(&values), &mut sum));
    black_box(sum);
    (8 * values.len()) as f64 / seconds
}

by_processor! {
    fn add_up(values: &[f64], sum: &mut [f64; 16]) from add_up_generic
}

#[inline(always)]
fn add_up_generic<const FMA: bool>(values: &[f64], sum: &mut [f64; 16]) {
    let mut own = *sum;
    for chunk in values.as_chunks::<16>().0 {
        for (own, value) in own.iter_mut().zip(chunk) {
            *own += value;
        }
    }
    *sum = own;
}

fn value(i: usize) -> f64 {
    (i as f64 * 12.9898).sin()
}

/// A full batch of rows on a triangle, the copy of the rows taken off the time.
fn compressing(columns: usize) -> (f64, f64) {
    const TIMES: usize = 200;
    let mut from = Tall::new(columns);
    from.reset(Tall::CAPACITY, columns);
    for j in 0..columns {
        for (i, out) in from.column_mut(j).iter_mut().enumerate() {
            *out = value(columns * i + j);
        }
    }
    let mut batch = from.clone();
    let mut triangle = vec![0.0; columns * columns];
    let refill = |batch: &mut Tall| {
        for j in 0..columns {
            batch.column_mut(j).copy_from_slice(from.column(j));
        }
    };
    let with = least(|| {
        for _ in 0..TIMES {
            refill(&mut batch);
            triangle.fill(0.0);
            compress(black_box(&mut batch), &mut triangle);
        }
    });
    let without = least(|| {
        for _ in 0..TIMES {
            refill(black_box(&mut batch));
        }
    });
    let flop = 2.0 * (Tall::CAPACITY * columns * columns) as f64;
    (flop, (with - without) / TIMES as f64)
}

/// Groups of eight rows, upper triangular in the order of the band, folded down a band.
fn folding() -> (f64, f64) {
    const N: usize = 300;
    const SPAN: usize = 12;
    const TAIL: usize = 15;
    const ROWS: usize = 8;
    let mut flop = 0.0;
    for k in 0..SPAN {
        // Rows that are not zero in column k by then.
        let rows = (0..ROWS).filter(|i| i + i / 2 <= k).count();
        flop += (rows * (4 * (SPAN - k + TAIL) + 2)) as f64;
    }
    let groups = (0..N - SPAN).step_by(3).count();
    let mut stack = RowStack::default();
    let mut triangle = BandTriangle::new(N, SPAN, TAIL);
    let mut run = |fold: bool| {
        least(|| {
            triangle = BandTriangle::new(N, SPAN, TAIL);
            for first in (0..N - SPAN).step_by(3) {
                stack.reset(first, SPAN, TAIL, ROWS);
                for i in 0..ROWS {
                    let row = stack.row_mut(i);
                    for (j, out) in row.iter_mut().enumerate().skip(i + i / 2) {
                        *out = 1.0 / (1 + i + j) as f64;
                    }
                }
                if fold {
                    triangle.fold(&mut stack);
                }
            }
            black_box(&triangle);
        })
    };
    let seconds = run(true) - run(false);
    (flop, seconds / groups as f64)
}

/// One pass over all readings at the seed, and the residuals there alone, on one thread, s.
fn pass(n: usize) -> Result<[f64; 2], Box<dyn std::error::Error>> {
    let basis = CubicBSpline::uniform(0.0, LENGTH, CELLS)?;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut plan = Plan::even(0.0, LENGTH, n, 0.02);
    plan.m = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_a = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_b = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (120e-6, -80e-6, 900e-6);
    plan.thickness_mm = THICKNESS;
    let channels = ChannelReadings::sort(&simulate(&plan, &[])?.0);
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
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    Ok(alone.install(|| {
        [
            least(|| drop(black_box(evaluate(&problem, &at)))),
            least(|| drop(black_box(problem.residuals(&at)))),
        ]
    }))
}
