//! Whole runs: minima, limits, observers, checkpoints.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use errsep_solvers::argmin::core::observers::{Observe, ObserverMode};
use errsep_solvers::argmin::core::{Error, KV};
use errsep_solvers::linear::LinearModel;
use errsep_solvers::linear::bordered::BorderedModel;
use errsep_solvers::structured::{Parameters, evaluate, fit_structured, fit_structured_with};
use errsep_solvers::{
    Bounds, CheckpointFile, Damping, Ending, FitError, FitState, Loss, Method, Options,
};
use nalgebra::DVector;

use super::problem::*;

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
