//! The structured solver against dense linear algebra, on a problem written as an outsider would.

use errsep_solvers::linear::bordered::{Bordered, BorderedCovariance, Constraints, Group, Share};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{
    Minimiser, Options, Parameters, Progress, Sink, StructuredProblem, StructuredSolver, evaluate,
    hat_traces, minimise,
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
fn parts_under_new_weights_are_those_of_a_problem_with_these_weights() {
    let weights = [3.0, 0.25];
    let mut problem = Bumps::new(9, 37, 0.1);
    let at = somewhere(&problem);
    let mut gathering = Minimiser::gathering(&problem, at.clone(), Options::default()).unwrap();
    gathering.reweigh(&weights);
    problem.weights = weights;
    let parts = gathering.parts(&problem).unwrap();
    let evaluation = evaluate(&problem, &at).unwrap();
    // Epsilons: the same rows, weighted before or after compression.
    assert!((gathering.cost() - evaluation.cost).abs() < 1e-13 * evaluation.cost);

    let missing = problem.constraints.missing(&at.band, &at.border);
    let solved = evaluation
        .system
        .solve(&problem.constraints, &missing, &problem.held)
        .unwrap();
    let covariance = BorderedCovariance::new(&evaluation.system, &solved);
    let traces = hat_traces(&problem, &at, &covariance).unwrap();
    let step: Vec<f64> = solved.band.iter().chain(&solved.border).copied().collect();
    let (jacobian, residual) = problem.dense(&at);
    let after = &residual + &jacobian * DVector::from_vec(step);
    // The hat matrix by dense algebra, row by row.
    let reduced = &jacobian * problem.allowed();
    let normal = (reduced.transpose() * &reduced).try_inverse().unwrap();
    let hat = &reduced * normal * reduced.transpose();
    for part in 0..2 {
        let own = |i: &usize| bumps(problem.x[*i], problem.cells()).0 % 2 == part;
        let rows: Vec<usize> = (0..problem.x.len()).filter(own).collect();
        let squares: f64 = rows.iter().map(|i| after[*i].powi(2)).sum();
        let trace: f64 = rows.iter().map(|i| hat[(*i, *i)]).sum();
        // Truncation: the check goes through normal equations of condition 1e6.
        assert!(
            (parts.squares[part] - squares).abs() < 1e-8 * squares,
            "part {part}"
        );
        assert!(
            (parts.traces[part] - trace).abs() < 1e-8 * trace,
            "part {part}"
        );
        assert!((traces[part] - trace).abs() < 1e-8 * trace, "part {part}");
    }

    let ending = loop {
        if let Progress::Done(ending) = gathering.advance(&problem) {
            break ending;
        }
    };
    let fit = gathering.finish(ending);
    let plain = minimise(&problem, at, Options::default()).unwrap();
    assert!(fit.converged() && plain.converged());
    // Both stop within the tolerance of the cost, 1e-12.
    assert!((fit.cost - plain.cost).abs() < 1e-11 * plain.cost);
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
    let near = minimise(
        &problem,
        Parameters::zeros(problem.coefficients, BORDER),
        Options::default(),
    )
    .unwrap();
    assert!(near.converged(), "{}", near.ending);
    let mut start = Parameters::zeros(problem.coefficients, BORDER);
    start.border[0] = 4.0;
    let far = minimise(&problem, start, Options::default()).unwrap();
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
fn argmin_drives_it_to_the_same_minimum() {
    let own = {
        let problem = Bumps::new(12, 40, 0.05);
        let start = Parameters::zeros(problem.coefficients, BORDER);
        minimise(&problem, start, Options::default()).unwrap()
    };
    let problem = Bumps::new(12, 40, 0.05);
    let start = Parameters::zeros(problem.coefficients, BORDER);
    let run = argmin::core::Executor::new(problem, StructuredSolver::new(Options::default()))
        .configure(|state| state.param(start))
        .run()
        .unwrap();
    assert_eq!(run.state.param.as_ref(), Some(&own.parameters));
    let fit = run.solver.into_fit().unwrap();
    assert_eq!(fit.ending, own.ending);
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
                minimise(&problem, start, Options::default()).unwrap()
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
    let fit = minimise(
        &problem,
        Parameters::zeros(problem.coefficients, BORDER),
        Options::default(),
    )
    .unwrap();
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
