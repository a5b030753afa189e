//! Triangle, steps, covariance and traces as dense algebra gives them.

use errsep_solvers::linear::bordered::{Bordered, BorderedCovariance, Constraints, Group};
use errsep_solvers::structured::{Parameters, evaluate, hat_traces};
use nalgebra::DVector;

use super::problem::*;

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
