//! The structured solver against dense linear algebra, on a problem written as an outsider would.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use errsep_solvers::argmin::core::observers::{Observe, ObserverMode};
use errsep_solvers::argmin::core::{Error, KV};
use errsep_solvers::linear::LinearModel;
use errsep_solvers::linear::bordered::{
    Bordered, BorderedCovariance, BorderedModel, Constraints, Group, Share,
};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{
    Parameters, Sink, StructuredFit, StructuredProblem, evaluate, fit_structured,
    fit_structured_with, hat_traces,
};
use errsep_solvers::{
    Bounds, CheckpointFile, Damping, Ending, FitError, FitState, Loss, Method, Options,
};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Piecewise quadratic bumps c_k on a line, seen through a stretch and a shift that all rows share:
/// r = Σ_k N_k(x) c_k · exp(y₀ sin 9x) + y₁ + y₂ cos 7.3x − data. The mean of c is tied to y₁ by a
/// constraint.
struct Bumps {
    x: Vec<f64>,
    data: Vec<f64>,
    coefficients: usize,
    constraints: Constraints,
    held: Vec<bool>,
    /// Of the rows of even and of odd cells: the two parts.
    weights: [f64; 2],
}

const BORDER: usize = 3;

impl Bumps {
    fn new(cells: usize, per_cell: usize, noise: f64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let coefficients = cells + 2;
        let x: Vec<f64> = (0..cells * per_cell)
            .map(|i| (i as f64 + 0.5) / per_cell as f64)
            .collect();
        let c: Vec<f64> = (0..coefficients)
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        let data = x
            .iter()
            .map(|x| {
                let (k, n) = bumps(*x, cells);
                let form: f64 = (0..3).map(|l| n[l] * c[k + l]).sum();
                let scaled = x / cells as f64;
                form * (0.3 * scaled).exp() + 0.2 - 0.1 * scaled
                    + noise * rng.random_range(-1.0..1.0)
            })
            .collect();
        let mut border = DMatrix::zeros(1, BORDER);
        border[(0, 1)] = 1.0;
        Self {
            x,
            data,
            coefficients,
            constraints: Constraints {
                band: vec![vec![1.0 / coefficients as f64; coefficients]],
                border,
                value: DVector::zeros(1),
            },
            held: vec![false; BORDER],
            weights: [1.0; 2],
        }
    }

    fn cells(&self) -> usize {
        self.coefficients - 2
    }

    /// Residual and dense row at a point.
    fn dense_row(&self, i: usize, at: &Parameters) -> (f64, Vec<f64>) {
        let x = self.x[i];
        let (k, n) = bumps(x, self.cells());
        let (swell, ripple) = ((9.0 * x).sin(), (7.3 * x).cos());
        let stretch = (at.border[0] * swell).exp();
        let mut row = vec![0.0; self.coefficients + BORDER];
        let mut form = 0.0;
        for l in 0..3 {
            row[k + l] = n[l] * stretch;
            form += n[l] * at.band[k + l];
        }
        row[self.coefficients] = form * swell * stretch;
        row[self.coefficients + 1] = 1.0;
        row[self.coefficients + 2] = ripple;
        let model = form * stretch + at.border[1] + at.border[2] * ripple;
        let weight = self.weights[k % 2];
        for value in &mut row {
            *value *= weight;
        }
        (weight * (model - self.data[i]), row)
    }

    fn dense(&self, at: &Parameters) -> (DMatrix<f64>, DVector<f64>) {
        let mut jacobian = DMatrix::zeros(self.x.len(), self.coefficients + BORDER);
        let mut residual = DVector::zeros(self.x.len());
        for i in 0..self.x.len() {
            let (r, row) = self.dense_row(i, at);
            residual[i] = r;
            jacobian.row_mut(i).copy_from_slice(&row);
        }
        (jacobian, residual)
    }

    /// A basis of the steps that keep the constraint: columns of length n + q.
    fn allowed(&self) -> DMatrix<f64> {
        let n = self.coefficients;
        // y₁ follows from c: leave it out and put the mean of c in its row.
        DMatrix::from_fn(n + BORDER, n + BORDER - 1, |i, j| {
            let own = if j <= n { j } else { j + 1 };
            match i {
                i if i == n + 1 => {
                    if j < n {
                        1.0 / n as f64
                    } else {
                        0.0
                    }
                }
                i => f64::from(u8::from(i == own)),
            }
        })
    }
}

/// Quadratic B-spline pieces on unit cells.
fn bumps(x: f64, cells: usize) -> (usize, [f64; 3]) {
    let k = (x.floor() as usize).min(cells - 1);
    let t = x - k as f64;
    (
        k,
        [0.5 * (1.0 - t).powi(2), 0.5 + t * (1.0 - t), 0.5 * t * t],
    )
}

fn solve(problem: &Bumps, start: Parameters) -> StructuredFit {
    fit_structured(problem, start, &Options::structured()).unwrap()
}

/// Every unknown of the border has a local column of its own, after those of the band.
fn own_columns(band: u32) -> Vec<Share> {
    (0..BORDER as u32)
        .map(|unknown| Share {
            column: band + unknown,
            unknown,
            weight: 1.0,
        })
        .collect()
}

impl StructuredProblem for Bumps {
    type Prepared = Parameters;

    fn band_count(&self) -> usize {
        self.coefficients
    }
    fn border_count(&self) -> usize {
        BORDER
    }
    fn part_count(&self) -> usize {
        2
    }
    fn constraints(&self) -> &Constraints {
        &self.constraints
    }
    fn held(&self) -> &[bool] {
        &self.held
    }
    fn prepare(&self, at: &Parameters) -> Result<Parameters, NoValue> {
        if at.border[0].abs() > 50.0 {
            return Err(NoValue::new("the stretch is beyond e^50"));
        }
        Ok(at.clone())
    }
    fn band_width(&self, _: &Parameters) -> usize {
        3
    }
    fn task_count(&self, _: &Parameters) -> usize {
        self.cells()
    }
    fn task(&self, at: &Parameters, cell: usize, sink: &mut Sink) -> Result<(), NoValue> {
        let rows: Vec<usize> = (0..self.x.len())
            .filter(|i| bumps(self.x[*i], self.cells()).0 == cell)
            .collect();
        sink.open(3 + BORDER + 1);
        for some in rows.chunks(100) {
            let batch = sink.batch(some.len());
            for (b, i) in some.iter().enumerate() {
                let (residual, row) = self.dense_row(*i, at);
                for l in 0..3 {
                    batch.column_mut(l)[b] = row[cell + l];
                }
                for l in 0..BORDER {
                    batch.column_mut(3 + l)[b] = row[self.coefficients + l];
                }
                batch.column_mut(3 + BORDER)[b] = residual;
            }
            sink.push();
        }
        sink.close(
            (cell..cell + 3).map(Some).collect(),
            own_columns(3),
            cell % 2,
        );
        Ok(())
    }
}

fn somewhere(problem: &Bumps) -> Parameters {
    let mut at = Parameters::zeros(problem.coefficients, BORDER);
    for (k, c) in at.band.iter_mut().enumerate() {
        *c = (k as f64).sin();
    }
    at.border[0] = 0.1;
    at.border[1] = at.band.iter().sum::<f64>() / problem.coefficients as f64;
    at
}

#[test]
fn the_triangle_is_that_of_the_dense_matrix() {
    let problem = Bumps::new(9, 37, 0.1);
    let at = somewhere(&problem);
    let evaluation = evaluate(&problem, &at).unwrap();
    let (jacobian, residual) = problem.dense(&at);
    // Epsilons: 333 rows of order one.
    assert!(
        (evaluation.cost - 0.5 * residual.norm_squared()).abs() < 1e-12 * residual.norm_squared()
    );
    let squares = evaluation.system.sum_of_squares();
    assert!((squares - residual.norm_squared()).abs() < 1e-12 * squares);
    let (band, border) = evaluation.system.column_norms();
    for (j, norm) in band.iter().chain(&border).enumerate() {
        assert!(
            (norm - jacobian.column(j).norm()).abs() < 1e-12 * (1.0 + norm),
            "column {j}"
        );
    }
}

#[test]
fn a_constrained_step_and_its_covariance_are_those_of_dense_algebra() {
    let problem = Bumps::new(9, 37, 0.1);
    let at = somewhere(&problem);
    let evaluation = evaluate(&problem, &at).unwrap();
    let missing = problem.constraints.missing(&at.band, &at.border);
    let solved = evaluation
        .system
        .solve(&problem.constraints, &missing, &problem.held)
        .unwrap();
    let (jacobian, residual) = problem.dense(&at);
    let allowed = problem.allowed();
    let reduced = &jacobian * &allowed;
    let normal = (reduced.transpose() * &reduced).try_inverse().unwrap();
    let step = -(&allowed * &normal * reduced.transpose() * &residual);
    let found: Vec<f64> = solved.band.iter().chain(&solved.border).copied().collect();
    for (j, (a, b)) in found.iter().zip(step.iter()).enumerate() {
        // Truncation: the check goes through normal equations of condition 1e4.
        assert!((a - b).abs() < 1e-9, "unknown {j}: {a} and {b}");
    }
    let after = &residual + &jacobian * &step;
    let reduction = 0.5 * (residual.norm_squared() - after.norm_squared());
    let predicted = evaluation
        .system
        .predicted_reduction(&solved.band, &solved.border);
    assert!((predicted - reduction).abs() < 1e-9 * reduction);

    let dense = &allowed * &normal * allowed.transpose();
    let covariance = BorderedCovariance::new(&evaluation.system, &solved);
    let n = problem.coefficients;
    for i in 0..n {
        for j in i..(i + 3).min(n) {
            let found = covariance.band(i, j).unwrap();
            assert!((found - dense[(i, j)]).abs() < 1e-9, "({i}, {j}): {found}");
        }
        for j in 0..BORDER {
            assert!((covariance.mixed(i, j) - dense[(i, n + j)]).abs() < 1e-9);
        }
    }
    // A combination far wider than the band.
    let (band, border) = (vec![(0, 1.0), (8, -2.0)], vec![(2, 0.5)]);
    let mut weights = DVector::zeros(n + BORDER);
    (weights[0], weights[8], weights[n + 2]) = (1.0, -2.0, 0.5);
    let exact = (weights.transpose() * &dense * &weights)[0];
    assert!((covariance.variance(&band, &border) - exact).abs() < 1e-9 * exact);
    let traces = hat_traces(&problem, &at, &covariance).unwrap();
    let trace = traces[0] + traces[1];
    // As many as free unknowns.
    assert!((trace - (n + BORDER - 1) as f64).abs() < 1e-9, "{trace}");
}

#[test]
fn traces_of_the_parts_are_those_of_dense_algebra() {
    let mut problem = Bumps::new(9, 37, 0.1);
    problem.weights = [3.0, 0.25];
    let at = somewhere(&problem);
    let evaluation = evaluate(&problem, &at).unwrap();
    let missing = problem.constraints.missing(&at.band, &at.border);
    let solved = evaluation
        .system
        .solve(&problem.constraints, &missing, &problem.held)
        .unwrap();
    let covariance = BorderedCovariance::new(&evaluation.system, &solved);
    let traces = hat_traces(&problem, &at, &covariance).unwrap();
    let (jacobian, _) = problem.dense(&at);
    // The hat matrix by dense algebra, row by row.
    let reduced = &jacobian * problem.allowed();
    let normal = (reduced.transpose() * &reduced).try_inverse().unwrap();
    let hat = &reduced * normal * reduced.transpose();
    for part in 0..2 {
        let own = |i: &usize| bumps(problem.x[*i], problem.cells()).0 % 2 == part;
        let rows: Vec<usize> = (0..problem.x.len()).filter(own).collect();
        let trace: f64 = rows.iter().map(|i| hat[(*i, *i)]).sum();
        // Truncation: the check goes through normal equations of condition 1e6.
        assert!((traces[part] - trace).abs() < 1e-8 * trace, "part {part}");
    }
}

#[test]
fn damping_is_that_of_dense_algebra() {
    let problem = Bumps::new(6, 20, 0.1);
    let at = somewhere(&problem);
    let system = evaluate(&problem, &at).unwrap().system;
    let (band, border) = system.column_norms();
    let damped = system.damped(0.3, &band, &border);
    let solved = damped
        .solve(
            &Constraints::none(BORDER),
            &DVector::zeros(0),
            &problem.held,
        )
        .unwrap();
    let (jacobian, residual) = problem.dense(&at);
    let mut normal = jacobian.transpose() * &jacobian;
    for j in 0..normal.ncols() {
        normal[(j, j)] *= 1.3;
    }
    let step = -(normal.try_inverse().unwrap() * jacobian.transpose() * residual);
    for (a, b) in solved.band.iter().chain(&solved.border).zip(step.iter()) {
        assert!((a - b).abs() < 1e-10, "{a} and {b}");
    }
}

#[test]
fn the_minimum_is_found_from_near_and_far() {
    let problem = Bumps::new(12, 40, 0.05);
    let near = solve(&problem, Parameters::zeros(problem.coefficients, BORDER));
    assert!(near.converged(), "{}", near.ending);
    let mut start = Parameters::zeros(problem.coefficients, BORDER);
    start.border[0] = 4.0;
    let far = solve(&problem, start);
    assert!(far.converged(), "{}", far.ending);
    // Both stop within the tolerance of the cost, 1e-12.
    assert!((near.cost - far.cost).abs() < 1e-11 * near.cost);
    let (jacobian, residual) = problem.dense(&near.parameters);
    let gradient = (&jacobian * problem.allowed()).transpose() * &residual;
    assert!(
        gradient.norm() < 1e-6 * jacobian.norm() * residual.norm(),
        "{}",
        gradient.norm()
    );
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let problem = Bumps::new(60, 50, 0.05);
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| {
                let start = Parameters::zeros(problem.coefficients, BORDER);
                solve(&problem, start)
            })
    };
    let one = run(1);
    for threads in [2, 3, 7] {
        let more = run(threads);
        assert_eq!(one.parameters, more.parameters, "{threads} threads");
        assert_eq!(one.cost.to_bits(), more.cost.to_bits());
    }
}

#[test]
fn what_the_rows_do_not_determine_is_named() {
    let mut problem = Bumps::new(6, 20, 0.1);
    // Without stretch and constraint a constant may move between the bumps and y₁.
    problem.constraints = Constraints::none(BORDER);
    problem.held[0] = true;
    let fit = solve(&problem, Parameters::zeros(problem.coefficients, BORDER));
    assert!(!fit.converged());
    assert!(
        fit.ending.to_string().contains("not identifiable"),
        "{}",
        fit.ending
    );
    assert!(fit.covariance().is_none());
}

#[test]
fn a_group_without_band_columns_counts_for_the_border() {
    let mut system = Bordered::new(3, 2, 2);
    let group = Group {
        band: vec![None],
        border: own_columns(1)[..2].to_vec(),
        columns: 4,
        part: 0,
        cost: 0.5,
        triangle: vec![
            1.0, 2.0, 3.0, 4.0, //
            0.0, 5.0, 6.0, 7.0, //
            0.0, 0.0, 8.0, 9.0, //
            0.0, 0.0, 0.0, 1.0,
        ],
    };
    system.absorb(&group, 1.0);
    system.finish();
    let squares = 16.0 + 49.0 + 81.0 + 1.0;
    // Epsilons: a sum of four squares.
    assert!((system.sum_of_squares() - squares).abs() < 1e-12);
    let (_, border) = system.column_norms();
    assert!((border[0] - (4.0_f64 + 25.0).sqrt()).abs() < 1e-14);
}

const METHODS: [Method; 5] = [
    Method::GaussNewton,
    Method::GaussNewtonFirst,
    Method::LevenbergMarquardt(Damping::More),
    Method::LevenbergMarquardt(Damping::Nielsen),
    Method::Dogleg,
];

#[test]
fn every_method_keeps_constraint_and_held_unknowns_and_finds_the_minimum() {
    for held in [false, true] {
        let mut problem = Bumps::new(12, 40, 0.05);
        (problem.held[1], problem.held[2]) = (held, held);
        let mut start = somewhere(&problem);
        start.border[2] = -0.05;
        let begun = start.border.clone();
        let promised = solve(&problem, start.clone());
        assert!(promised.converged(), "{}", promised.ending);
        for method in METHODS {
            let options = Options::with_method(method);
            let fit = fit_structured(&problem, start.clone(), &options).unwrap();
            assert!(fit.converged(), "{method:?}: {}", fit.ending);
            // Both lie within the tolerance of the promised cost, 1e-12.
            assert!(
                (fit.cost - promised.cost).abs() < 1e-11 * promised.cost,
                "{method:?}: {} and {}",
                fit.cost,
                promised.cost
            );
            // Truncation: the root of that tolerance times unknowns of order one.
            let apart = (fit.parameters.joined() - promised.parameters.joined()).amax();
            assert!(apart < 1e-5, "{method:?}: {apart:e}");
            let (band, border) = (&fit.parameters.band, &fit.parameters.border);
            let missing = problem.constraints.missing(band, border).amax();
            // Epsilons: a mean of fourteen numbers of order one.
            assert!(missing < 1e-14, "{method:?}: {missing:e}");
            assert!(!held || border[1..] == begun[1..], "{method:?}");
        }
    }
}

#[test]
fn the_last_step_is_taken_on_its_promise_without_a_pass() {
    let mut problem = Bumps::new(12, 40, 0.05);
    // Without the stretch the problem is linear: the first step is the last.
    problem.held[0] = true;
    let start = somewhere(&problem);
    let whole = solve(&problem, start.clone());
    assert_eq!(whole.passes, 2);
    let trusting = Options {
        cost_tolerance: 0.9999,
        ..Options::structured()
    };
    let fit = fit_structured(&problem, start, &trusting).unwrap();
    assert!(fit.converged(), "{}", fit.ending);
    assert_eq!(fit.passes, 1);
    // Epsilons through a condition of 1e4.
    let apart = (fit.parameters.joined() - whole.parameters.joined()).amax();
    assert!(apart < 1e-11, "{apart:e}");
    assert!((fit.cost - whole.cost).abs() < 1e-11 * whole.cost);
}

#[test]
fn the_gradient_of_the_model_vanishes_at_the_constrained_minimum() {
    let problem = Bumps::new(12, 40, 0.05);
    let options = Options::with_method(Method::GaussNewtonFirst);
    let at = fit_structured(&problem, somewhere(&problem), &options)
        .unwrap()
        .parameters;
    let evaluation = evaluate(&problem, &at).unwrap();
    let (band, border) = evaluation.system.gradient();
    let plain = DVector::from_iterator(
        problem.coefficients + BORDER,
        band.into_iter().chain(border),
    );
    let point = (at.band.as_slice(), at.border.as_slice());
    let model = BorderedModel::new(
        evaluation.system,
        &problem.constraints,
        &problem.held,
        point,
    );
    let cosine = |gradient: &DVector<f64>| {
        gradient.component_div(model.column_norms()).amax() / (2.0 * evaluation.cost).sqrt()
    };
    // Epsilons of the residuals' own sums; the constraint pulls a little at the minimum.
    assert!(
        cosine(model.gradient()) < 1e-11,
        "{}",
        cosine(model.gradient())
    );
    assert!(cosine(&plain) > 1e-6, "{}", cosine(&plain));
    // Steepest descent keeps the constraint, and what is held.
    let system = evaluate(&problem, &somewhere(&problem)).unwrap().system;
    for held in [[false; BORDER], [false, true, false]] {
        let model = BorderedModel::new(system.clone(), &problem.constraints, &held, point);
        let downhill = model.steepest_descent(&DVector::from_element(plain.len(), 2.0));
        let (band, border) = downhill.as_slice().split_at(problem.coefficients);
        let left = problem.constraints.missing(band, border).amax();
        // Epsilons: a mean of fourteen numbers.
        assert!(left <= 1e-14 * downhill.amax(), "{left:e}");
        assert!(downhill.amax() > 0.0 && (!held[1] || border[1] == 0.0));
    }
}

#[test]
fn the_slope_of_a_damped_step_is_that_of_its_length() {
    let problem = Bumps::new(9, 37, 0.1);
    let at = somewhere(&problem);
    let system = evaluate(&problem, &at).unwrap().system;
    let point = (at.band.as_slice(), at.border.as_slice());
    let model = BorderedModel::new(system, &problem.constraints, &problem.held, point);
    let scale = model.column_norms().clone();
    let length = |damping: f64| {
        let step = model.damped_step(damping, &scale).step;
        step.component_mul(&scale).norm()
    };
    let (damping, h) = (0.3, 1e-4);
    let difference = (length(damping + h) - length(damping - h)) / (2.0 * h);
    let slope = -model.damped_step(damping, &scale).slope * length(damping);
    // Truncation: h² times a third derivative of order ten.
    assert!(
        (slope - difference).abs() < 1e-6 * slope.abs(),
        "{slope} and {difference}"
    );
}

/// Notes the cost of each iteration, and fails after some.
struct Watcher {
    costs: Arc<Mutex<Vec<f64>>>,
    fails_after: usize,
}

impl Observe<FitState> for Watcher {
    fn observe_iter(&mut self, state: &FitState, _: &KV) -> Result<(), Error> {
        let mut costs = self.costs.lock().expect("one thread");
        costs.push(state.cost);
        if costs.len() >= self.fails_after {
            return Err(Error::msg("power cut"));
        }
        Ok(())
    }
}

/// A start from which steps fail before one is taken.
fn far(problem: &Bumps) -> Parameters {
    let mut start = Parameters::zeros(problem.coefficients, BORDER);
    start.border[0] = 4.0;
    start
}

#[test]
fn an_observer_sees_each_iteration_and_a_killed_run_continues_to_the_same_bits() {
    let problem = Bumps::new(12, 40, 0.05);
    let options = Options::structured();
    let costs = Arc::new(Mutex::new(Vec::new()));
    let watcher = |fails_after| Watcher {
        costs: Arc::clone(&costs),
        fails_after,
    };
    let whole = fit_structured_with(&problem, far(&problem), &options, |executor| {
        executor.add_observer(watcher(usize::MAX), ObserverMode::Always)
    })
    .unwrap();
    assert!(whole.converged(), "{}", whole.ending);
    let seen = std::mem::take(&mut *costs.lock().unwrap());
    assert_eq!(seen.len() as u64, whole.iterations);
    assert_eq!(seen.last(), Some(&whole.cost));
    assert!(seen.windows(2).all(|pair| pair[1] <= pair[0]), "{seen:?}");
    // One pass at the start and one a step, but for the last, which is taken on its promise.
    assert_eq!(whole.passes, whole.history.len() as u64);
    assert!(whole.history.iter().any(|step| !step.accepted));

    let folder = tempfile::tempdir().unwrap();
    let file = || CheckpointFile::new(folder.path().join("run"), 1);
    let cut = fit_structured_with(&problem, far(&problem), &options, |executor| {
        executor
            .add_observer(watcher(3), ObserverMode::Always)
            .checkpointing(file())
    });
    assert!(matches!(cut, Err(FitError::BrokenOff { .. })));
    let continued = fit_structured_with(&problem, far(&problem), &options, |executor| {
        executor.checkpointing(file())
    })
    .unwrap();
    assert_eq!(continued.parameters, whole.parameters);
    assert_eq!(continued.ending, whole.ending);
    // The finished run is in the checkpoint: nothing is left to do.
    let again = fit_structured_with(&problem, far(&problem), &options, |executor| {
        executor.checkpointing(file())
    })
    .unwrap();
    assert_eq!(again.parameters, whole.parameters);
    assert_eq!(again.ending, whole.ending);
}

#[test]
fn limits_and_a_raised_flag_end_the_run() {
    let problem = Bumps::new(12, 40, 0.05);
    let end = |options: Options| {
        let fit = fit_structured(&problem, far(&problem), &options).unwrap();
        assert!(fit.covariance().is_none());
        fit.ending
    };
    let limited = Options {
        max_iterations: 2,
        ..Options::structured()
    };
    assert_eq!(end(limited), Ending::IterationLimit);
    let timed = Options {
        time_limit: Some(Duration::ZERO),
        ..Options::structured()
    };
    assert_eq!(end(timed), Ending::TimeLimit);
    let stopped = Options {
        stop: Some(Arc::new(AtomicBool::new(true))),
        ..Options::structured()
    };
    assert_eq!(end(stopped), Ending::StoppedByUser);
}

#[test]
fn settings_that_are_the_problems_own_are_refused() {
    let problem = Bumps::new(6, 20, 0.1);
    let settings = [
        (
            "bounds",
            Options {
                bounds: Some(Bounds::none(problem.coefficients + BORDER)),
                ..Options::structured()
            },
        ),
        (
            "loss",
            Options {
                loss: Loss::Huber { scale: 1.0 },
                ..Options::structured()
            },
        ),
        (
            "geodesic_acceleration",
            Options {
                geodesic_acceleration: true,
                ..Options::structured()
            },
        ),
    ];
    for (name, options) in settings {
        match fit_structured(&problem, somewhere(&problem), &options) {
            Err(FitError::Setting { setting, .. }) => assert_eq!(setting, name),
            other => panic!("{name}: {:?}", other.map(|fit| fit.ending)),
        }
    }
    let short = Parameters::zeros(problem.coefficients - 1, BORDER + 1);
    assert!(matches!(
        fit_structured(&problem, short, &Options::structured()),
        Err(FitError::StartLength { .. })
    ));
}
