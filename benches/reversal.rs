//! Time of the simultaneous fit by readings and by knots, beside dense ways to the same minimum.
//!
//! `cargo bench -p errsep-campaigns --bench reversal`
//!
//! Four channels × N readings, 60 interior knots in each of three forms, exact rotation and a
//! thickness of 42 mm. The structured times are of the whole library call: sorting, seed, gauge,
//! minimisation, covariance, residuals. The dense ways start from the same seed and are timed for
//! the minimisation alone; their costs at the end are printed beside ours.

use std::hint::black_box;

use argmin::core::{CostFunction, Error, Executor, Jacobian, Operator};
use argmin::solver::gaussnewton::GaussNewton;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::simultaneous::{
    self, Axis, ChannelReadings, DenseReversal, Knots, Noise, Options, Reversal, Thickness,
    Unknowns, fit,
};
use errsep_models::reversal::{Channel, Convention, Observations};
use errsep_solvers::Problem;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const THICKNESS: f64 = 42.0;
const CELLS: usize = 61;

fn readings(n: usize, cells: usize) -> (Observations, CubicBSpline) {
    let basis = CubicBSpline::uniform(0.0, 300.0, cells).expect("cells over a range");
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut plan = Plan::even(0.0, 300.0, n, 0.02);
    plan.m = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_a = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_b = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (120e-6, -80e-6, 900e-6);
    plan.thickness_mm = THICKNESS;
    (
        simulate(&plan, &[]).expect("a plan that makes sense").0,
        basis,
    )
}

fn options(basis: &CubicBSpline, noise: Noise) -> Options {
    Options {
        thickness: Thickness::Known(THICKNESS),
        noise,
        knots: Knots::At(basis.breaks().to_vec()),
        ..Options::default()
    }
}

fn by_readings(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("simultaneous fit by readings a channel");
    let largest: usize = std::env::var("ERRSEP_BENCH_READINGS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(200_000);
    for n in [2_000, 20_000, 200_000, 2_000_000]
        .into_iter()
        .filter(|n| *n <= largest)
    {
        let (observations, basis) = readings(n, CELLS);
        group.sample_size(if n > 20_000 { 10 } else { 20 });
        for (name, noise) in [
            ("equal noise", Noise::Equal),
            ("noise per channel", Noise::Estimated),
        ] {
            let options = options(&basis, noise);
            group.bench_with_input(BenchmarkId::new(name, n), &n, |bencher, _| {
                bencher.iter(|| fit(black_box(&observations), &options).expect("a minimum"));
            });
        }
    }
    group.finish();
}

fn by_knots(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("simultaneous fit of 4 x 20000 readings by cells");
    group.sample_size(10);
    for cells in [20, 60, 200, 600, 2_000, 5_000] {
        let (observations, basis) = readings(20_000, cells);
        let options = options(&basis, Noise::Equal);
        group.bench_with_input(BenchmarkId::from_parameter(cells), &cells, |bencher, _| {
            bencher.iter(|| fit(black_box(&observations), &options).expect("a minimum"));
        });
    }
    group.finish();
}

struct ForArgmin<'a>(&'a DenseReversal<'a>);

impl Operator for ForArgmin<'_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;
    fn apply(&self, p: &DVector<f64>) -> Result<DVector<f64>, Error> {
        Ok(self.0.residuals(p)?)
    }
}

impl Jacobian for ForArgmin<'_> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;
    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        Ok(self.0.jacobian(p)?)
    }
}

impl CostFunction for ForArgmin<'_> {
    type Param = DVector<f64>;
    type Output = f64;
    fn cost(&self, p: &DVector<f64>) -> Result<f64, Error> {
        Ok(self.0.residuals(p)?.norm())
    }
}

struct ForLm<'a> {
    problem: &'a DenseReversal<'a>,
    at: DVector<f64>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for ForLm<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    fn set_params(&mut self, p: &DVector<f64>) {
        self.at.copy_from(p);
    }
    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }
    fn residuals(&self) -> Option<DVector<f64>> {
        self.problem.residuals(&self.at).ok()
    }
    fn jacobian(&self) -> Option<DMatrix<f64>> {
        self.problem.jacobian(&self.at).ok()
    }
}

fn beside_dense(criterion: &mut Criterion) {
    let n = 2_000;
    let (observations, basis) = readings(n, CELLS);
    let channels = ChannelReadings::sort(&observations);
    let unknowns = Unknowns::new(Channel::ALL.to_vec(), Convention::Seed, false, CELLS + 3);
    let axis = Axis::of(&channels).expect("positions differ");
    let lines = simultaneous::lines(&channels).expect("positions differ");
    let tilts = simultaneous::tilts(&unknowns, &lines);
    let start = simultaneous::start(&unknowns, &tilts, &lines, THICKNESS);
    let problem = Reversal::new(
        &channels,
        unknowns,
        vec![basis.clone(); 3],
        axis,
        THICKNESS,
        vec![1.0; 4],
    );
    let dense = DenseReversal::new(&problem);
    let from = dense.parameters_of(&start);

    let ours = || fit(&observations, &options(&basis, Noise::Equal)).expect("a minimum");
    let qr = || {
        errsep_solvers::fit(&dense, from.clone(), &errsep_solvers::Options::default())
            .expect("a problem that makes sense")
    };
    let gauss_newton = || {
        Executor::new(ForArgmin(&dense), GaussNewton::new())
            .configure(|state| state.param(from.clone()).max_iters(6))
            .run()
            .expect("a run of Gauss-Newton")
    };
    let minpack = || {
        let problem = ForLm {
            problem: &dense,
            at: from.clone(),
        };
        LevenbergMarquardt::new().minimize(problem)
    };
    let least = 0.5 * ours().residuals.iter().map(|r| r * r).sum::<f64>();
    let above = |cost: f64| cost / least - 1.0;
    println!("cost at the end, relative to ours, less one, at N = {n}:");
    println!("  own dense method      {:+.1e}", above(qr().cost));
    println!(
        "  argmin GaussNewton    {:+.1e}",
        above(0.5 * gauss_newton().state.best_cost.powi(2))
    );
    println!(
        "  levenberg-marquardt   {:+.1e}",
        above(minpack().1.objective_function)
    );

    let mut group = criterion.benchmark_group("4 x 2000 readings, by method");
    group.sample_size(10);
    group.bench_function("structured, whole call", |b| b.iter(ours));
    group.bench_function("own dense method", |b| b.iter(qr));
    group.bench_function("argmin GaussNewton", |b| b.iter(gauss_newton));
    group.bench_function("levenberg-marquardt", |b| b.iter(minpack));
    group.finish();
}

criterion_group!(benches, by_readings, by_knots, beside_dense);
criterion_main!(benches);
