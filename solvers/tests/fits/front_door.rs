//! One good problem through the front door, then one thing wrong at a time.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use errsep_solvers::{
    Bounds, Convergence, Damping, Ending, FitError, Loss, Method, NoValue, Options, Problem, fit,
};
use nalgebra::{DMatrix, DVector};

/// y = a exp(−k t) + c at 30 times, exact but for a fixed pattern of errors.
struct Decay {
    error: f64,
    wrong_sign: bool,
}

fn time(i: usize) -> f64 {
    0.2 * i as f64
}

const TRUTH: [f64; 3] = [3.0, 0.7, 0.5];

impl Problem for Decay {
    fn parameter_count(&self) -> usize {
        3
    }

    fn residual_count(&self) -> usize {
        30
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        if p[1] < -5.0 {
            return Err(NoValue::new("a decay cannot grow that fast"));
        }
        Ok(DVector::from_fn(30, |i, _| {
            let reading = TRUTH[0] * (-TRUTH[1] * time(i)).exp() + TRUTH[2];
            let error = self.error * (1.3 * i as f64 * i as f64).sin();
            p[0] * (-p[1] * time(i)).exp() + p[2] - reading - error
        }))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let sign = if self.wrong_sign { -1.0 } else { 1.0 };
        Ok(DMatrix::from_fn(30, 3, |i, j| {
            let decay = (-p[1] * time(i)).exp();
            sign * [decay, -p[0] * time(i) * decay, 1.0][j]
        }))
    }

    fn parameter_name(&self, index: usize) -> String {
        ["amplitude", "rate", "offset"][index].to_string()
    }
}

const EXACT: Decay = Decay {
    error: 0.0,
    wrong_sign: false,
};
const NOISY: Decay = Decay {
    error: 0.01,
    wrong_sign: false,
};

fn start() -> DVector<f64> {
    DVector::from_vec(vec![1.0, 0.1, 0.0])
}

#[test]
fn finds_the_truth_and_says_how() {
    let fit = fit(&EXACT, start(), &Options::default()).expect("a good problem");
    assert!(fit.ending.is_converged(), "{}", fit.ending);
    for (found, truth) in fit.parameters.iter().zip(TRUTH) {
        // epsilons: residuals of a few eps through a condition number below 10
        assert!(
            (found - truth).abs() < 100.0 * f64::EPSILON,
            "{found} {truth}"
        );
    }
    assert_eq!(fit.names, ["amplitude", "rate", "offset"]);
}

#[test]
fn uncertainties_come_from_the_residuals() {
    let fit = fit(&NOISY, start(), &Options::default()).expect("a good problem");
    let covariance = fit.covariance();
    let scaled = covariance
        .scaled_by_residuals()
        .expect("27 degrees of freedom");
    assert_eq!(covariance.degrees_of_freedom, 27);
    let gram = fit.jacobian.tr_mul(&fit.jacobian);
    let inverse = gram.try_inverse().expect("regular");
    let deviation = fit.residual_deviation().expect("27 degrees of freedom");
    for j in 0..3 {
        let direct = inverse[(j, j)].sqrt() * deviation;
        // epsilons times the squared condition number of the direct way
        assert!((scaled.standard_uncertainty(j) / direct - 1.0).abs() < 1e-11);
    }
    // the errors have a root mean square of 0.01/√2
    assert!((deviation / 0.00707 - 1.0).abs() < 0.3, "{deviation}");
}

#[test]
fn a_wrong_jacobian_ends_without_descent() {
    let wrong = Decay {
        wrong_sign: true,
        ..NOISY
    };
    for method in [
        Method::GaussNewton,
        Method::Dogleg,
        Method::LevenbergMarquardt(Damping::More),
        Method::LevenbergMarquardt(Damping::Nielsen),
    ] {
        let fit = fit(&wrong, start(), &Options::with_method(method)).expect("computable");
        assert_eq!(fit.ending, Ending::NoDescent, "{method:?}");
        assert!(fit.ending.to_string().contains("check the Jacobian"));
    }
}

#[test]
fn a_parameter_without_effect_is_named() {
    // at amplitude zero the rate has no effect; the bound keeps it there
    let options = Options {
        bounds: Some(Bounds::none(3).with(0, 0.0, 0.0)),
        ..Options::default()
    };
    let start = DVector::from_vec(vec![0.0, 0.3, 0.0]);
    let fit = fit(&NOISY, start, &options).expect("computable");
    let Ending::NotIdentifiable { combinations, .. } = &fit.ending else {
        panic!("{}", fit.ending);
    };
    assert_eq!(combinations.len(), 1);
    assert_eq!(combinations[0].terms[0].0, "rate");
    assert!(fit.ending.to_string().contains("`rate` has no effect"));
    let covariance = fit.covariance();
    assert_eq!(covariance.standard_uncertainty(1), f64::INFINITY);
    assert_eq!(covariance.standard_uncertainty(0), 0.0);
    assert!(covariance.standard_uncertainty(2).is_finite());
    assert_eq!(covariance.active_bounds[0].name, "amplitude");
}

#[test]
fn a_bound_holds_and_is_told() {
    let options = Options {
        bounds: Some(Bounds::none(3).with(1, 0.0, 0.5)),
        ..Options::default()
    };
    let fit = fit(&NOISY, start(), &options).expect("computable");
    assert!(fit.ending.is_converged(), "{}", fit.ending);
    assert_eq!(fit.parameters[1], 0.5);
    assert_eq!(fit.active_bounds.len(), 1);
    assert_eq!(fit.active_bounds[0].name, "rate");
    let gradient = fit.jacobian.tr_mul(&fit.residuals);
    for j in [0, 2] {
        let cosine = gradient[j] / (fit.jacobian.column(j).norm() * fit.residuals.norm());
        // epsilons: the free parameters are at their minimum on the face
        assert!(cosine.abs() < 1e-12, "{cosine}");
    }
    assert!(gradient[1] < 0.0);
}

#[test]
fn limits_end_with_their_words() {
    let few = Options {
        max_iterations: 1,
        ..Options::default()
    };
    let ended = fit(&NOISY, start(), &few).expect("computable");
    assert_eq!(ended.ending, Ending::IterationLimit);
    let hasty = Options {
        time_limit: Some(Duration::ZERO),
        ..Options::default()
    };
    let ended = fit(&NOISY, start(), &hasty).expect("computable");
    assert_eq!(ended.ending, Ending::TimeLimit);
    let stopped = Options {
        stop: Some(Arc::new(AtomicBool::new(true))),
        ..Options::default()
    };
    let ended = fit(&NOISY, start(), &stopped).expect("computable");
    assert_eq!(ended.ending, Ending::StoppedByUser);
    assert_eq!(ended.parameters, start());
}

#[test]
fn every_loss_ignores_an_outlier_more_than_least_squares_does() {
    struct Spoiled;
    impl Problem for Spoiled {
        fn parameter_count(&self) -> usize {
            3
        }
        fn residual_count(&self) -> usize {
            30
        }
        fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
            let mut r = NOISY.residuals(p)?;
            r[4] -= 2.0;
            Ok(r)
        }
        fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
            NOISY.jacobian(p)
        }
    }
    let rate_error = |loss| {
        let options = Options {
            loss,
            ..Options::default()
        };
        // near enough for Tukey's loss, which beyond its scale is flat
        let start = DVector::from_vec(vec![2.99, 0.695, 0.502]);
        let fit = fit(&Spoiled, start, &options).expect("computable");
        assert!(fit.ending.is_converged(), "{loss:?}: {}", fit.ending);
        assert!(
            matches!(fit.ending, Ending::Converged(Convergence::Step)),
            "{loss:?}"
        );
        (fit.parameters[1] - TRUTH[1]).abs()
    };
    let plain = rate_error(Loss::Quadratic);
    for loss in [
        Loss::Huber { scale: 0.01 },
        Loss::SoftL1 { scale: 0.01 },
        Loss::Cauchy { scale: 0.02 },
        Loss::Tukey { scale: 0.04 },
    ] {
        let robust = rate_error(loss);
        assert!(robust < 0.1 * plain, "{loss:?}: {robust} against {plain}");
    }
}

#[test]
fn what_cannot_be_fitted_says_why() {
    let message = |start: Vec<f64>, options: Options| {
        fit(&NOISY, DVector::from_vec(start), &options)
            .expect_err("wrong on purpose")
            .to_string()
    };
    let plain = Options::default;
    assert!(message(vec![1.0, 2.0], plain()).contains("2 values, the problem 3"));
    assert!(message(vec![1.0, f64::NAN, 0.0], plain()).contains("`rate` is NaN"));
    assert!(message(vec![1.0, -9.0, 0.0], plain()).contains("cannot grow that fast"));
    let outside = Options {
        bounds: Some(Bounds::none(3).with(0, 2.0, 3.0)),
        ..plain()
    };
    assert!(message(vec![1.0, 0.1, 0.0], outside).contains("`amplitude` is 1, outside"));
    let crossed = Options {
        bounds: Some(Bounds::none(3).with(0, 3.0, 2.0)),
        ..plain()
    };
    assert!(message(vec![1.0, 0.1, 0.0], crossed).contains("lower must not exceed"));
    let setting = Options {
        step_tolerance: -1.0,
        ..plain()
    };
    assert!(message(vec![1.0, 0.1, 0.0], setting).contains("`step_tolerance` is -1"));
}

#[test]
fn too_few_residuals_are_refused() {
    struct Short;
    impl Problem for Short {
        fn parameter_count(&self) -> usize {
            3
        }
        fn residual_count(&self) -> usize {
            2
        }
        fn residuals(&self, _: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
            Ok(DVector::zeros(2))
        }
        fn jacobian(&self, _: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
            Ok(DMatrix::zeros(2, 3))
        }
    }
    let refused = fit(&Short, start(), &Options::default()).expect_err("two for three");
    assert_eq!(
        refused,
        FitError::FewerResidualsThanParameters {
            residuals: 2,
            parameters: 3
        }
    );
}
