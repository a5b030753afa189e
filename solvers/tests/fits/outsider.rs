//! The library as a stranger uses it: public items only, everything through the crate's root.

use std::sync::{Arc, Mutex};

use errsep_solvers::argmin::core::observers::{Observe, ObserverMode};
use errsep_solvers::argmin::core::{Error, KV};
use errsep_solvers::{
    Bounds, CheckpointFile, Ending, FitError, FitState, Loss, Method, NoValue, Options, Problem,
    ResidualScale, bootstrap, check_jacobian, fit, fit_with, profile_interval,
};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

/// A sphere's radius and height from a depth gauge: h − √(R² − x²) with R ≥ 5.
struct Dome;

const DEPTHS: [f64; 7] = [0.4641, 0.2554, 0.0839, 0.0201, -0.0004, 0.0199, 0.0848];

impl Problem for Dome {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        DEPTHS.len()
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        if p[0] <= 4.0 {
            return Err(NoValue::new(format!(
                "no sphere of radius {} reaches x = 4",
                p[0]
            )));
        }
        Ok(DVector::from_fn(DEPTHS.len(), |i, _| {
            let x = i as f64 - 4.0;
            p[1] - (p[0] * p[0] - x * x).sqrt() - DEPTHS[i]
        }))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_fn(DEPTHS.len(), 2, |i, j| {
            let x = i as f64 - 4.0;
            if j == 1 {
                1.0
            } else {
                -p[0] / (p[0] * p[0] - x * x).sqrt()
            }
        }))
    }

    fn parameter_name(&self, index: usize) -> String {
        ["radius", "height"][index].to_string()
    }
}

#[test]
fn a_stranger_fits_and_states_an_uncertainty() {
    let start = dvector![10.0, 10.0];
    assert!(check_jacobian(&Dome, &start).expect("defined").worst() < 1e-8);
    let options = Options::default();
    let fit = fit(&Dome, start, &options).expect("a good problem");
    assert!(fit.ending.is_converged(), "{}", fit.ending);
    let covariance = fit.covariance().scaled_by_residuals().expect("5 left");
    let uncertainty = covariance.standard_uncertainty(0);
    let interval = profile_interval(&Dome, &fit, 0, 0.95, ResidualScale::Estimated, &options)
        .expect("a regular minimum");
    assert!(interval.contains(fit.parameters[0]) && uncertainty > 0.0);
    let again = bootstrap(&Dome, &fit, 100, 1, &options).expect("5 left");
    let (low, high) = again.studentised_interval(0, 0.95).expect("100 replicates");
    assert!(low < fit.parameters[0] && fit.parameters[0] < high);
}

#[test]
fn a_stranger_is_told_what_the_model_refused() {
    let refused = fit(&Dome, dvector![3.0, 3.0], &Options::default()).expect_err("too small");
    assert!(
        refused.to_string().contains("no sphere of radius 3"),
        "{refused}"
    );
}

#[test]
fn a_stranger_bounds_and_weighs_down() {
    let options = Options {
        bounds: Some(Bounds::none(2).with(0, 5.0, 12.0)),
        loss: Loss::Huber { scale: 0.01 },
        ..Options::with_method(Method::Dogleg)
    };
    let fit = fit(&Dome, dvector![6.0, 6.0], &options).expect("a good problem");
    assert!(fit.ending.is_minimum(), "{}", fit.ending);
    assert!((5.0..=12.0).contains(&fit.parameters[0]));
}

struct Valley;

impl Problem for Valley {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        2
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(dvector![10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]])
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(dmatrix![-20.0 * p[0], 10.0; -1.0, 0.0])
    }
}

/// Notes the cost of each iteration, and fails after some.
struct Watcher {
    costs: Arc<Mutex<Vec<f64>>>,
    fails_after: usize,
}

impl Observe<FitState> for Watcher {
    fn observe_iter(&mut self, state: &FitState, _: &KV) -> Result<(), Error> {
        let mut costs = self.costs.lock().expect("no panic while held");
        costs.push(state.get_cost());
        if costs.len() >= self.fails_after {
            return Err(Error::msg("the power is gone"));
        }
        Ok(())
    }
}

fn watched(fails_after: usize) -> (Arc<Mutex<Vec<f64>>>, Watcher) {
    let costs = Arc::new(Mutex::new(Vec::new()));
    let watcher = Watcher {
        costs: Arc::clone(&costs),
        fails_after,
    };
    (costs, watcher)
}

#[test]
fn an_observer_sees_the_cost_fall() {
    let (costs, watcher) = watched(usize::MAX);
    let fit = fit_with(
        &Valley,
        dvector![-1.2, 1.0],
        &Options::default(),
        |executor| executor.add_observer(watcher, ObserverMode::Always),
    )
    .expect("a good problem");
    let costs = costs.lock().expect("done");
    assert_eq!(costs.len() as u64, fit.iterations);
    assert!(costs.windows(2).all(|pair| pair[1] <= pair[0]), "{costs:?}");
}

#[test]
fn a_killed_run_continues_to_the_same_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("valley");
    let (start, options) = (dvector![-1.2, 1.0], Options::default());
    let whole = fit(&Valley, start.clone(), &options).expect("a good problem");

    let (_, watcher) = watched(6);
    let killed = fit_with(&Valley, start.clone(), &options, |executor| {
        executor
            .checkpointing(CheckpointFile::new(&file, 1))
            .add_observer(watcher, ObserverMode::Always)
    });
    let Err(FitError::BrokenOff { reason }) = killed else {
        panic!("{killed:?}");
    };
    assert!(reason.contains("power"), "{reason}");

    let (costs, watcher) = watched(usize::MAX);
    let continued = fit_with(&Valley, start.clone(), &options, |executor| {
        executor
            .checkpointing(CheckpointFile::new(&file, 1))
            .add_observer(watcher, ObserverMode::Always)
    })
    .expect("a good problem");
    assert_eq!(continued.parameters, whole.parameters);
    assert_eq!(continued.ending, whole.ending);
    assert_eq!(continued.iterations, whole.iterations);
    // five iterations were saved before the sixth was cut
    assert_eq!(
        costs.lock().expect("done").len() as u64,
        whole.iterations - 5
    );

    // a checkpoint of another problem, or no checkpoint at all, is refused with its name
    let other = fit_with(&Dome, dvector![10.0, 10.0], &options, |executor| {
        std::fs::write(&file, "not a checkpoint").expect("writable");
        executor.checkpointing(CheckpointFile::new(&file, 1))
    });
    let message = other.expect_err("unreadable").to_string();
    assert!(
        message.contains("valley") && message.contains("start afresh"),
        "{message}"
    );
}

/// Readings of a parabola: three parameters.
struct Parabola;

impl Problem for Parabola {
    fn parameter_count(&self) -> usize {
        3
    }

    fn residual_count(&self) -> usize {
        5
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(DVector::from_fn(5, |i, _| {
            let x = i as f64;
            p[0] + p[1] * x + p[2] * x * x - (1.0 + 0.3 * x).exp()
        }))
    }

    fn jacobian(&self, _: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_fn(5, 3, |i, j| (i as f64).powi(j as i32)))
    }
}

#[test]
fn a_checkpoint_of_a_problem_of_another_size_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    // One saved in the middle of a run, one at its end.
    for iterations in [3, 1000] {
        let file = folder.path().join(format!("after{iterations}"));
        let options = Options {
            max_iterations: iterations,
            ..Options::default()
        };
        fit_with(&Valley, dvector![-1.2, 1.0], &options, |executor| {
            executor.checkpointing(CheckpointFile::new(&file, 1))
        })
        .expect("a good problem");
        for limit in [iterations, 2000] {
            let options = Options {
                max_iterations: limit,
                ..Options::default()
            };
            let other = fit_with(&Parabola, dvector![0.0, 0.0, 0.0], &options, |executor| {
                executor.checkpointing(CheckpointFile::new(&file, 1))
            });
            let expected = FitError::CheckpointLength {
                expected: 3,
                found: 2,
            };
            assert_eq!(other.expect_err("another size"), expected);
        }
    }
}

#[test]
fn endings_are_sentences() {
    let fit = fit(&Valley, dvector![-1.2, 1.0], &Options::default()).expect("a good problem");
    assert!(matches!(fit.ending, Ending::Converged(_)));
    assert_eq!(
        fit.ending.to_string(),
        "converged: the next step is negligible"
    );
}
