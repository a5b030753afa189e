//! The front door for structured problems.

use argmin::core::Executor;

use super::problem::{Parameters, StructuredProblem};
use super::system::Structured;
use crate::fit::{Finished, check_start, finish, run};
use crate::linear::bordered::{Bordered, BorderedCovariance, BorderedModel, Solved};
use crate::nonlinear::minimiser::{FitState, Minimiser};
use crate::nonlinear::strategy::Steps;
use crate::options::Options;
use crate::outcome::{Ending, FitError, Iteration};

/// The argmin executor behind [`fit_structured`], to which observers and checkpoints are added.
pub type StructuredExecutor<'a, P> =
    Executor<Structured<'a, P>, Minimiser<Steps, BorderedModel<'a>>, FitState>;

/// The result of a fit of a structured problem: rows were made, used and forgotten, and what is left
/// of them is one triangle.
#[derive(Debug, Clone)]
pub struct StructuredFit {
    /// The parameters.
    pub parameters: Parameters,
    /// ½ Σ r², or ½ Σ ρ(r²) under a robust loss.
    pub cost: f64,
    /// Why the fit ended.
    pub ending: Ending,
    /// Iterations made.
    pub iterations: u64,
    /// Passes made over the rows.
    pub passes: u64,
    /// What became of each step: one a pass but the first, and the last, which was taken on its
    /// promise.
    pub history: Vec<Iteration>,
    system: Bordered,
    solved: Option<Solved>,
}

/// Fits a structured problem: finds parameters near `start`, which satisfies the constraints, that
/// minimise ½ Σ r²; [`Options::structured`] has the settings to take.
///
/// # Errors
/// As [`fit`](crate::fit); and [`FitError::Setting`] for bounds, a loss or geodesic acceleration: a
/// structured problem holds unknowns and weighs rows itself.
pub fn fit_structured<P: StructuredProblem>(
    problem: &P,
    start: Parameters,
    options: &Options,
) -> Result<StructuredFit, FitError> {
    fit_structured_with(problem, start, options, |executor| executor)
}

/// As [`fit_structured`], with argmin's executor open to the caller: `configure` adds observers, a
/// checkpoint, interruption by Ctrl-C.
///
/// # Errors
/// As [`fit_structured`]; an observer or checkpoint that fails breaks the run off.
pub fn fit_structured_with<'a, P: StructuredProblem>(
    problem: &'a P,
    start: Parameters,
    options: &Options,
    configure: impl FnOnce(StructuredExecutor<'a, P>) -> StructuredExecutor<'a, P>,
) -> Result<StructuredFit, FitError> {
    options.validate()?;
    check_settings(options)?;
    check_lengths(problem, &start)?;
    let (system, start) = (Structured::new(problem), start.joined());
    check_start(&system, &start)?;
    let Finished {
        system,
        point,
        ending,
        effort,
        ..
    } = finish(run(system, start, options, configure)?)?;
    let parameters = system.point(&point.parameters);
    let (triangle, solved) = point.model.into_parts();
    Ok(StructuredFit {
        parameters,
        cost: point.evaluation.cost,
        ending,
        iterations: effort.iterations,
        passes: effort.residual_evaluations,
        history: effort.history,
        system: triangle,
        solved,
    })
}

/// Refuses settings that a structured problem sees to itself.
fn check_settings(options: &Options) -> Result<(), FitError> {
    let refuse = |setting, must| {
        Err(FitError::Setting {
            setting,
            value: "given".to_string(),
            must,
        })
    };
    if options.bounds.is_some() {
        return refuse(
            "bounds",
            "left out for a structured problem: it holds unknowns itself",
        );
    }
    if options.loss.scale().is_some() {
        return refuse(
            "loss",
            "left out for a structured problem: it weighs its rows itself",
        );
    }
    if options.geodesic_acceleration {
        return refuse(
            "geodesic_acceleration",
            "left out for a structured problem: its rows are forgotten",
        );
    }
    Ok(())
}

/// Refuses a start of a problem of another size.
fn check_lengths<P: StructuredProblem>(problem: &P, at: &Parameters) -> Result<(), FitError> {
    let sizes = [
        (problem.band_count(), at.band.len()),
        (problem.border_count(), at.border.len()),
    ];
    match sizes
        .into_iter()
        .find(|(expected, found)| expected != found)
    {
        Some((expected, found)) => Err(FitError::StartLength { expected, found }),
        None => Ok(()),
    }
}

impl StructuredFit {
    /// Whether the end is a minimum that determines everything.
    pub fn converged(&self) -> bool {
        self.ending.is_converged()
    }

    /// Covariances for rows in units of their standard deviation; `None` where the fit did not
    /// reach a minimum that determines everything.
    pub fn covariance(&self) -> Option<BorderedCovariance> {
        let solved = self.solved.as_ref().filter(|_| self.converged())?;
        Some(BorderedCovariance::new(&self.system, solved))
    }

    /// The value that a held border unknown would take if it were released too, to first order, and
    /// the covariance of all unknowns for unit noise then: is the model's fixed value right?
    pub fn released<P: StructuredProblem>(
        &self,
        problem: &P,
        release: usize,
    ) -> Option<(f64, BorderedCovariance)> {
        let mut held = problem.held().to_vec();
        *held.get_mut(release)? = false;
        let constraints = problem.constraints();
        let missing = constraints.missing(&self.parameters.band, &self.parameters.border);
        let solved = self.system.solve(constraints, &missing, &held).ok()?;
        if !solved.undetermined.is_empty() {
            return None;
        }
        Some((
            self.parameters.border[release] + solved.border[release],
            BorderedCovariance::new(&self.system, &solved),
        ))
    }
}
