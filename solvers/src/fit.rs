//! The front door: fit a problem from a start.

use argmin::core::{Executor, OptimizationResult, State, TerminationReason};
use nalgebra::DVector;

use crate::bounds::{ActiveBound, Bounds};
use crate::linear::LinearModel;
use crate::linear::dense::DenseModel;
use crate::linear::triangle::Triangle;
use crate::nonlinear::minimiser::{FitState, Minimiser, Point, broken_off};
use crate::nonlinear::strategy::Steps;
use crate::nonlinear::system::{Dense, System};
use crate::nonlinear::variable_projection::{ProjectedJacobian, VariableProjection};
use crate::options::Options;
use crate::outcome::{Convergence, Ending, Fit, FitError, Iteration};
use crate::problem::Problem;
use crate::separable::{Joint, SeparableProblem};

/// The argmin solver behind [`fit`].
pub type DenseMinimiser = Minimiser<Steps, DenseModel>;

/// The argmin executor behind [`fit`], to which observers and checkpoints are added.
pub type FitExecutor<'a, P> = Executor<Dense<'a, P>, DenseMinimiser, FitState>;

/// Fits a problem: finds parameters near `start` (length n) that minimise ½ Σ ρ(rᵢ²).
///
/// # Errors
/// [`FitError`] when the fit cannot be made at all. A fit that was made but did not reach a
/// minimum, or reached one that does not determine every parameter, is an `Ok` whose
/// [`Fit::ending`] says so.
pub fn fit<P: Problem + ?Sized>(
    problem: &P,
    start: DVector<f64>,
    options: &Options,
) -> Result<Fit, FitError> {
    fit_any(&problem, start, options)
}

/// [`fit`], compiled once for all problems rather than once for each.
fn fit_any(problem: &dyn Problem, start: DVector<f64>, options: &Options) -> Result<Fit, FitError> {
    fit_with(problem, start, options, |executor| executor)
}

/// As [`fit`], with argmin's executor open to the caller: `configure` adds observers, a
/// checkpoint, interruption by Ctrl-C.
///
/// A run continued from a checkpoint continues with the settings it was begun with.
///
/// # Errors
/// As [`fit`]; an observer or checkpoint that fails breaks the run off.
pub fn fit_with<'a, P: Problem + ?Sized>(
    problem: &'a P,
    start: DVector<f64>,
    options: &Options,
    configure: impl FnOnce(FitExecutor<'a, P>) -> FitExecutor<'a, P>,
) -> Result<Fit, FitError> {
    options.validate()?;
    check_problem(problem)?;
    let system = dense(problem, options);
    check_start(&system, &start)?;
    if let Some(bounds) = &options.bounds {
        check_bounds(problem, bounds, &start)?;
    }

    let Finished {
        system,
        point,
        unit,
        ending,
        mut effort,
    } = finish(run(system, start, options, configure)?)?;
    // Factoring consumed the Jacobian: one more evaluation costs less than holding two.
    effort.jacobian_evaluations += 1;
    assemble(problem, &system, (point, unit), ending, effort, options)
}

/// The executor of a system's minimiser.
type SystemExecutor<O> = Executor<O, Minimiser<Steps, <O as System>::Model>, FitState>;

/// What it leaves.
type Run<O> = OptimizationResult<O, Minimiser<Steps, <O as System>::Model>, FitState>;

/// Minimises any system under argmin's executor.
pub(crate) fn run<O: System>(
    system: O,
    start: DVector<f64>,
    options: &Options,
    configure: impl FnOnce(SystemExecutor<O>) -> SystemExecutor<O>,
) -> Result<Run<O>, FitError> {
    let minimiser = Minimiser::new(Steps::of(options), options.clone());
    let mut executor = Executor::new(system, minimiser)
        .configure(|state| state.param(start).max_iters(options.max_iterations))
        .ctrlc(false);
    if let Some(limit) = options.time_limit {
        executor = executor.timeout(limit);
    }
    configure(executor).run().map_err(broken_off)
}

/// A run at its end.
pub(crate) struct Finished<O: System> {
    pub system: O,
    pub point: Point<O::Model>,
    pub unit: f64,
    pub ending: Ending,
    pub effort: Effort,
}

/// Why a run ended, where, and what it cost.
pub(crate) fn finish<O: System>(run: Run<O>) -> Result<Finished<O>, FitError> {
    let ending = run
        .solver
        .ending()
        .cloned()
        .unwrap_or_else(|| ending_from(run.state.get_termination_reason()));
    let count = |name: &str| run.problem.counts.get(name).copied().unwrap_or(0);
    let effort = Effort {
        iterations: run.state.get_iter(),
        residual_evaluations: count("residual_count"),
        jacobian_evaluations: count("jacobian_count"),
        history: run.solver.history.clone(),
    };
    let system = run.problem.get_problem().ok_or_else(lost)?;
    let unit = run.solver.unit;
    let point = match run.solver.point {
        Some(point) => point,
        // A checkpoint of a finished run carries parameters only.
        None => {
            let parameters = run.state.get_param().cloned().ok_or_else(lost)?;
            run.solver
                .check_lengths(system.parameter_count(), &parameters)?;
            point_at(&system, parameters, unit)?
        }
    };
    Ok(Finished {
        system,
        point,
        unit,
        ending,
        effort,
    })
}

/// Fits a separable problem by variable projection from a start of its nonlinear parameters
/// (length k): returns the fit in all parameters, nonlinear ones first. Bounds are on the
/// nonlinear parameters.
///
/// # Errors
/// As [`fit`]; and [`FitError::Setting`] for a robust loss, under which the linear parameters are
/// no longer those of least squares: fit [`Joint`] then.
pub fn fit_separable<P: SeparableProblem + ?Sized>(
    problem: &P,
    start: DVector<f64>,
    jacobian: ProjectedJacobian,
    options: &Options,
) -> Result<Fit, FitError> {
    if options.loss.scale().is_some() {
        return Err(FitError::Setting {
            setting: "loss",
            value: "robust".to_string(),
            must: "quadratic for variable projection: fit `Joint` instead",
        });
    }
    let joint = Joint(problem);
    let (parameters, residuals) = (joint.parameter_count(), joint.residual_count());
    if residuals < parameters {
        return Err(FitError::FewerResidualsThanParameters {
            residuals,
            parameters,
        });
    }
    let projection = VariableProjection::new(problem, jacobian, options.rank_tolerance);
    let projected = fit(&projection, start, options)?;

    let linear = projection
        .linear_parameters(&projected.parameters)
        .map_err(|no| FitError::NoJacobian { reason: no.reason })?;
    in_all_parameters(&joint, projected, &linear, options)
}

/// A fit in the nonlinear parameters as one in all of them.
fn in_all_parameters(
    joint: &dyn Problem,
    projected: Fit,
    linear: &DVector<f64>,
    options: &Options,
) -> Result<Fit, FitError> {
    let parameters = joint.parameter_count();
    let k = projected.parameters.len();
    let all = DVector::from_fn(parameters, |i, _| match i.checked_sub(k) {
        Some(j) => linear[j],
        None => projected.parameters[i],
    });
    let free = Options {
        bounds: options.bounds.as_ref().map(|b| b.extended(linear.len())),
        ..options.clone()
    };
    let system = dense(joint, &free);
    let unit = projected.unit;
    let point = point_at(&system, all, unit)?;
    let ending = joint_ending(projected.ending, joint, &point);
    let effort = Effort {
        iterations: projected.iterations,
        residual_evaluations: projected.residual_evaluations,
        jacobian_evaluations: projected.jacobian_evaluations,
        history: projected.history,
    };
    assemble(joint, &system, (point, unit), ending, effort, &free)
}

/// The ending in all parameters: a minimum may leave linear parameters undetermined.
fn joint_ending(projected: Ending, joint: &dyn Problem, point: &Point<DenseModel>) -> Ending {
    let by = match &projected {
        Ending::Converged(by) | Ending::NotIdentifiable { by, .. } => *by,
        _ => return projected,
    };
    let names = names_of(joint);
    let combinations = point.model.undetermined(&names);
    if combinations.is_empty() {
        return projected;
    }
    Ending::NotIdentifiable { by, combinations }
}

/// What a fit cost.
pub(crate) struct Effort {
    pub iterations: u64,
    pub residual_evaluations: u64,
    pub jacobian_evaluations: u64,
    pub history: Vec<Iteration>,
}

fn dense<'a, P: Problem + ?Sized>(problem: &'a P, options: &Options) -> Dense<'a, P> {
    Dense::new(
        problem,
        options.loss,
        options.factorization,
        options.rank_tolerance,
    )
}

fn names_of<P: Problem + ?Sized>(problem: &P) -> Vec<String> {
    (0..problem.parameter_count())
        .map(|j| problem.parameter_name(j))
        .collect()
}

fn point_at<O: System>(
    system: &O,
    parameters: DVector<f64>,
    unit: f64,
) -> Result<Point<O::Model>, FitError> {
    let mut evaluation = system
        .evaluate(&parameters, unit)
        .map_err(|no| FitError::NoValueAtStart { reason: no.reason })?;
    let model = system.linearize(&parameters, &mut evaluation, unit)?;
    Ok(Point {
        parameters,
        evaluation,
        model,
    })
}

fn assemble<P: Problem + ?Sized>(
    problem: &P,
    system: &Dense<'_, P>,
    (point, unit): (Point<DenseModel>, f64),
    ending: Ending,
    effort: Effort,
    options: &Options,
) -> Result<Fit, FitError> {
    let Point {
        parameters,
        evaluation,
        model,
    } = point;
    let names = names_of(problem);
    let active_bounds = options
        .bounds
        .as_ref()
        .map(|bounds| active_bounds(bounds, &parameters, model.gradient(), &names))
        .unwrap_or_default();
    let jacobian = system.jacobian(&parameters)?;
    let next_step = relative_step(&model, &parameters, &active_bounds);
    let triangle = free_triangle(
        &jacobian,
        unit,
        &evaluation.residuals,
        model,
        options,
        &active_bounds,
    );
    Ok(Fit {
        parameters,
        residuals: evaluation.residuals * unit,
        jacobian,
        cost: evaluation.cost * unit * unit,
        ending,
        iterations: effort.iterations,
        residual_evaluations: effort.residual_evaluations,
        jacobian_evaluations: effort.jacobian_evaluations,
        history: effort.history,
        next_step,
        names,
        active_bounds,
        loss: options.loss,
        triangle,
        unit,
    })
}

fn check_problem<P: Problem + ?Sized>(problem: &P) -> Result<(), FitError> {
    let (parameters, residuals) = (problem.parameter_count(), problem.residual_count());
    if residuals < parameters {
        return Err(FitError::FewerResidualsThanParameters {
            residuals,
            parameters,
        });
    }
    Ok(())
}

/// Refuses a start of the wrong length or with values that are not finite.
pub(crate) fn check_start<O: System>(system: &O, start: &DVector<f64>) -> Result<(), FitError> {
    let parameters = system.parameter_count();
    if parameters == 0 {
        return Err(FitError::NoParameters);
    }
    if start.len() != parameters {
        return Err(FitError::StartLength {
            expected: parameters,
            found: start.len(),
        });
    }
    match start.iter().position(|value| !value.is_finite()) {
        Some(j) => Err(FitError::StartNotFinite {
            parameter: system.parameter_name(j),
            value: start[j],
        }),
        None => Ok(()),
    }
}

fn check_bounds<P: Problem + ?Sized>(
    problem: &P,
    bounds: &Bounds,
    start: &DVector<f64>,
) -> Result<(), FitError> {
    let expected = start.len();
    for side in [bounds.lower(), bounds.upper()] {
        if side.len() != expected {
            return Err(FitError::BoundsLength {
                expected,
                found: side.len(),
            });
        }
    }
    for (j, &value) in start.iter().enumerate() {
        let (lower, upper) = (bounds.lower()[j], bounds.upper()[j]);
        let parameter = problem.parameter_name(j);
        if lower.is_nan() || upper.is_nan() || lower > upper {
            return Err(FitError::BoundsCrossed {
                parameter,
                lower,
                upper,
            });
        }
        if value < lower || value > upper {
            return Err(FitError::StartOutsideBounds {
                parameter,
                value,
                lower,
                upper,
            });
        }
    }
    Ok(())
}

fn ending_from(reason: Option<&TerminationReason>) -> Ending {
    match reason {
        Some(TerminationReason::Timeout) => Ending::TimeLimit,
        Some(TerminationReason::MaxItersReached) => Ending::IterationLimit,
        Some(TerminationReason::TargetCostReached) => Ending::Converged(Convergence::Cost),
        _ => Ending::StoppedByUser,
    }
}

fn lost() -> FitError {
    FitError::BrokenOff {
        reason: "the run ended without its problem or its parameters".to_string(),
    }
}

fn active_bounds(
    bounds: &Bounds,
    parameters: &DVector<f64>,
    gradient: &DVector<f64>,
    names: &[String],
) -> Vec<ActiveBound> {
    (0..parameters.len())
        .filter_map(|index| {
            let side = bounds.pressed(index, parameters[index], gradient[index])?;
            Some(ActiveBound {
                index,
                name: names[index].clone(),
                side,
                value: parameters[index],
            })
        })
        .collect()
}

fn free_indices(parameters: usize, active: &[ActiveBound]) -> Vec<usize> {
    (0..parameters)
        .filter(|&j| active.iter().all(|bound| bound.index != j))
        .collect()
}

/// ‖D s‖ / ‖D p‖ of the undamped step in the free parameters.
fn relative_step(model: &DenseModel, parameters: &DVector<f64>, active: &[ActiveBound]) -> f64 {
    let norms = model.column_norms();
    let length = parameters.component_mul(norms).norm();
    let step = if active.is_empty() {
        model.undamped_step().component_mul(norms).norm()
    } else {
        let free = free_indices(parameters.len(), active);
        model
            .restricted(&free, &DVector::zeros(parameters.len()))
            .map_or(0.0, |reduced| {
                let step = reduced.undamped_step();
                step.component_mul(reduced.column_norms()).norm()
            })
    };
    if length > 0.0 { step / length } else { step }
}

/// The triangle of the plain Jacobian, of residuals in `unit`, in the free parameters: that of the
/// last model unless a robust loss has weighted its rows.
fn free_triangle(
    jacobian: &nalgebra::DMatrix<f64>,
    unit: f64,
    residuals: &DVector<f64>,
    model: DenseModel,
    options: &Options,
    active: &[ActiveBound],
) -> Triangle {
    let plain = if options.loss.scale().is_some() {
        DenseModel::new(
            jacobian / unit,
            residuals,
            options.factorization,
            options.rank_tolerance,
        )
    } else {
        model
    };
    let parameters = plain.parameter_count();
    let free = free_indices(parameters, active);
    if free.len() == parameters {
        return plain.triangle().clone();
    }
    match plain.restricted(&free, &DVector::zeros(parameters)) {
        Some(reduced) => reduced.triangle().clone(),
        None => plain.triangle().clone(),
    }
}
