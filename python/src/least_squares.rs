//! The engine on residuals that Python works out.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use errsep::io::Message;
use errsep_models::uncertainty::{DegreesOfFreedom, coverage_factor};
use errsep_solvers::argmin::core::observers::ObserverMode;
use errsep_solvers::{
    Bounds, Combination, Damping, Ending, Factorization, Fit, FitError, Limit, Loss, Method,
    Options, ProfileInterval, ResidualScale, Side, fit_with, profile_interval,
};
use nalgebra::{DMatrix, DVector};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::exception;
use crate::interrupts::Interrupts;
use crate::long::without_the_lock;
use crate::stated::{Raised, Stated, Told, residuals_of};

/// What a fit is asked for, as a dictionary of Python.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked {
    names: Vec<String>,
    start: Vec<f64>,
    lower: Option<Vec<f64>>,
    upper: Option<Vec<f64>>,
    method: String,
    factorization: String,
    geodesic_acceleration: bool,
    loss: String,
    loss_scale: f64,
    cost_tolerance: f64,
    step_tolerance: f64,
    gradient_tolerance: f64,
    rank_tolerance: Option<f64>,
    max_iterations: u64,
    time_limit: Option<f64>,
    known_scale: bool,
    profile: Option<f64>,
    coverage: f64,
}

/// Fits: `residuals` and `jacobian` take an array of parameters and return arrays of float64.
///
/// Returns a dictionary of plain values; an exception raised by a function of Python goes on.
#[pyfunction]
pub fn least_squares<'py>(
    py: Python<'py>,
    residuals: Py<PyAny>,
    jacobian: Option<Py<PyAny>>,
    callback: Option<Py<PyAny>>,
    asked: Asked,
) -> PyResult<Bound<'py, PyDict>> {
    let start = DVector::from_vec(asked.start.clone());
    let raised = Raised::default();
    let stop = Arc::new(AtomicBool::new(false));
    let options = options(py, &asked, jacobian.is_some(), &stop)?;
    let interrupts = Arc::new(Interrupts::watch(py)?);
    let at_start = residuals_of(py, &residuals, &start)?;
    let problem = Stated {
        names: asked.names.clone(),
        residuals,
        jacobian,
        first: (start.clone(), at_start),
        raised: raised.clone(),
        stop: Arc::clone(&stop),
        interrupts: Arc::clone(&interrupts),
    };
    let told = Told {
        callback,
        raised: raised.clone(),
        stop: Arc::clone(&stop),
        interrupts,
    };
    let found = without_the_lock(py, || {
        let fit = fit_with(&problem, start, &options, |executor| {
            executor.add_observer(told, ObserverMode::Always)
        })?;
        let profiles = match asked.profile {
            Some(level) if fit.ending.is_converged() => {
                profiles(&problem, &fit, level, asked.known_scale, &options)?
            }
            _ => Vec::new(),
        };
        Ok::<_, FitError>((fit, profiles))
    });
    if let Some(error) = raised.take() {
        return Err(error);
    }
    let wrong = |e: FitError| exception(py, &Message::bad_input(e.to_string()));
    let (fit, profiles) = found.map_err(wrong)?;
    answer(py, &fit, &profiles, &asked)
}

/// The share below which a direction counts as undetermined where the Jacobian is of differences.
const RANK_TOLERANCE_OF_DIFFERENCES: f64 = 1e-7;

fn options(
    py: Python<'_>,
    asked: &Asked,
    has_jacobian: bool,
    stop: &Arc<AtomicBool>,
) -> PyResult<Options> {
    let defaults = Options::default();
    let scale = asked.loss_scale;
    let bounds = match (&asked.lower, &asked.upper) {
        (Some(lower), Some(upper)) => Some(Bounds::new(
            DVector::from_column_slice(lower),
            DVector::from_column_slice(upper),
        )),
        _ => None,
    };
    let unknown = |what: &str, found: &str, known: &str| {
        let told = Message::bad_input(format!("there is no {what} {found:?}"));
        exception(py, &told.remedy(format!("give {known}")))
    };
    let time_limit = asked.time_limit.map(Duration::try_from_secs_f64);
    Ok(Options {
        method: match asked.method.as_str() {
            "levenberg-marquardt" => Method::LevenbergMarquardt(Damping::More),
            "nielsen" => Method::LevenbergMarquardt(Damping::Nielsen),
            "gauss-newton" => Method::GaussNewton,
            "dogleg" => Method::Dogleg,
            other => {
                let known = "levenberg-marquardt, nielsen, gauss-newton or dogleg";
                return Err(unknown("method", other, known));
            }
        },
        factorization: match asked.factorization.as_str() {
            "qr" => Factorization::Qr,
            "svd" => Factorization::Svd,
            other => return Err(unknown("factorization", other, "qr or svd")),
        },
        geodesic_acceleration: asked.geodesic_acceleration,
        loss: match asked.loss.as_str() {
            "quadratic" => Loss::Quadratic,
            "huber" => Loss::Huber { scale },
            "soft-l1" => Loss::SoftL1 { scale },
            "cauchy" => Loss::Cauchy { scale },
            "tukey" => Loss::Tukey { scale },
            other => {
                let known = "quadratic, huber, soft-l1, cauchy or tukey";
                return Err(unknown("loss", other, known));
            }
        },
        bounds,
        cost_tolerance: asked.cost_tolerance,
        step_tolerance: asked.step_tolerance,
        gradient_tolerance: asked.gradient_tolerance,
        rank_tolerance: asked.rank_tolerance.unwrap_or(if has_jacobian {
            defaults.rank_tolerance
        } else {
            RANK_TOLERANCE_OF_DIFFERENCES
        }),
        max_iterations: asked.max_iterations,
        time_limit: time_limit
            .transpose()
            .map_err(|e| exception(py, &Message::bad_input(format!("time_limit: {e}"))))?,
        stop: Some(Arc::clone(stop)),
        ..defaults
    })
}

/// The profile-likelihood interval of every parameter that is not held by a bound.
fn profiles(
    problem: &Stated,
    fit: &Fit,
    level: f64,
    known_scale: bool,
    options: &Options,
) -> Result<Vec<(String, ProfileInterval)>, FitError> {
    let scale = if known_scale {
        ResidualScale::Known
    } else {
        ResidualScale::Estimated
    };
    let free = |j: &usize| fit.active_bounds.iter().all(|b| b.index != *j);
    (0..fit.parameters.len())
        .filter(free)
        .map(|j| {
            let interval = profile_interval(problem, fit, j, level, scale, options)?;
            Ok((fit.names[j].clone(), interval))
        })
        .collect()
}

/// The word by which programs know an ending.
fn ending(ending: &Ending) -> &'static str {
    match ending {
        Ending::Converged(_) => "converged",
        Ending::NotIdentifiable { .. } => "not-identifiable",
        Ending::IterationLimit => "iteration-limit",
        Ending::TimeLimit => "time-limit",
        Ending::NoDescent => "no-descent",
        Ending::AtWall { .. } => "at-wall",
        Ending::RunsAway { .. } => "runs-away",
        Ending::OutOfRange => "out-of-range",
        Ending::StoppedByUser => "stopped",
    }
}

fn matrix<'py>(py: Python<'py>, m: &DMatrix<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let by_rows: Vec<f64> = m.transpose().as_slice().to_vec();
    PyArray1::from_vec(py, by_rows).reshape([m.nrows(), m.ncols()])
}

fn limit(limit: Limit) -> (&'static str, f64) {
    match limit {
        Limit::At(value) => ("at", value),
        Limit::Bound(value) => ("bound", value),
        Limit::Open(value) => ("open", value),
    }
}

/// What turns a standard uncertainty into an expanded one; none without degrees of freedom.
fn factor(asked: &Asked, fit: &Fit) -> Option<f64> {
    let degrees = if asked.known_scale {
        DegreesOfFreedom::Infinite
    } else {
        DegreesOfFreedom::new(fit.degrees_of_freedom() as f64).ok()?
    };
    coverage_factor(asked.coverage, degrees).ok()
}

fn answer<'py>(
    py: Python<'py>,
    fit: &Fit,
    profiles: &[(String, ProfileInterval)],
    asked: &Asked,
) -> PyResult<Bound<'py, PyDict>> {
    let unit = fit.covariance();
    // Without degrees of freedom nothing tells the scale: the uncertainties are then unknown.
    let covariance = if asked.known_scale {
        Some(unit.clone())
    } else {
        unit.scaled_by_residuals()
    };
    let combination = |c: &Combination| (c.terms.clone(), c.to_string());
    let undetermined: Vec<_> = unit.undetermined.iter().map(combination).collect();
    let side = |side: Side| match side {
        Side::Lower => "lower",
        Side::Upper => "upper",
    };
    let bounds = fit.active_bounds.iter();
    let bounds: Vec<_> = bounds
        .map(|b| (b.name.clone(), side(b.side), b.value))
        .collect();
    let answer = PyDict::new(py);
    answer.set_item("names", &fit.names)?;
    let array = |v: &DVector<f64>| PyArray1::from_slice(py, v.as_slice());
    answer.set_item("parameters", array(&fit.parameters))?;
    answer.set_item("residuals", array(&fit.residuals))?;
    answer.set_item("jacobian", matrix(py, &fit.jacobian)?)?;
    answer.set_item("cost", fit.cost)?;
    answer.set_item("kind", ending(&fit.ending))?;
    answer.set_item("ending", fit.ending.to_string())?;
    answer.set_item("iterations", fit.iterations)?;
    answer.set_item("residual_evaluations", fit.residual_evaluations)?;
    answer.set_item("jacobian_evaluations", fit.jacobian_evaluations)?;
    answer.set_item("degrees_of_freedom", fit.degrees_of_freedom())?;
    answer.set_item("residual_std", fit.residual_deviation())?;
    answer.set_item("known_scale", asked.known_scale)?;
    answer.set_item("coverage_factor", factor(asked, fit))?;
    if let Some(covariance) = &covariance {
        answer.set_item("covariance", matrix(py, &covariance.matrix)?)?;
        answer.set_item("std", array(&covariance.standard_uncertainties()))?;
    }
    answer.set_item("not_determined", undetermined)?;
    answer.set_item("active_bounds", bounds)?;
    let interval = |(name, i): &(String, ProfileInterval)| {
        let ends = (limit(i.lower), limit(i.upper));
        (name.clone(), ends)
    };
    answer.set_item("profile", profiles.iter().map(interval).collect::<Vec<_>>())?;
    Ok(answer)
}
