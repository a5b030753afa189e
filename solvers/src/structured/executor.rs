//! The structured solver under argmin's executor: observers, time limits, checkpoints of the
//! parameters.

use argmin::core::{
    Error, IterState, KV, Problem as Counted, Solver, TerminationReason, TerminationStatus,
};

use super::minimise::{Fit, Minimiser};
use super::problem::{Parameters, StructuredProblem};
use super::progress::{Options, Progress};
use crate::outcome::Ending;

/// The state argmin's observers see: parameters and cost.
pub type StructuredState = IterState<Parameters, (), (), (), (), f64>;

/// Steps of [`minimise`](super::minimise) as an argmin solver. One iteration is one pass over the
/// rows.
#[derive(Debug, Clone)]
pub struct StructuredSolver {
    options: Options,
    minimiser: Option<Minimiser>,
    ending: Option<Ending>,
}

impl StructuredSolver {
    /// A solver that stops as these options say.
    pub fn new(options: Options) -> Self {
        Self {
            options,
            minimiser: None,
            ending: None,
        }
    }

    /// The result after a run; `None` before. A run that was cut short ends at the limit.
    pub fn into_fit(self) -> Option<Fit> {
        let ending = self.ending.unwrap_or(Ending::IterationLimit);
        Some(self.minimiser?.finish(ending))
    }

    fn show(&self, state: StructuredState) -> StructuredState {
        match &self.minimiser {
            Some(m) => state.param(m.parameters().clone()).cost(m.cost()),
            None => state,
        }
    }
}

impl<P: StructuredProblem> Solver<P, StructuredState> for StructuredSolver {
    fn name(&self) -> &str {
        "structured Gauss-Newton, damped where a step fails"
    }

    fn init(
        &mut self,
        problem: &mut Counted<P>,
        mut state: StructuredState,
    ) -> Result<(StructuredState, Option<KV>), Error> {
        let start = state.take_param().ok_or_else(|| {
            Error::msg("no start: give one by `configure(|state| state.param(...))`")
        })?;
        let minimiser = problem.problem("passes", |problem| {
            Ok(Minimiser::new(problem, start, self.options)?)
        })?;
        self.minimiser = Some(minimiser);
        Ok((self.show(state), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Counted<P>,
        state: StructuredState,
    ) -> Result<(StructuredState, Option<KV>), Error> {
        if let Some(minimiser) = &mut self.minimiser {
            let progress = problem.problem("passes", |problem| Ok(minimiser.advance(problem)))?;
            if let Progress::Done(ending) = progress {
                self.ending = Some(ending);
            }
        }
        Ok((self.show(state), None))
    }

    fn terminate(&mut self, _: &StructuredState) -> TerminationStatus {
        match &self.ending {
            None => TerminationStatus::NotTerminated,
            Some(ending) if ending.is_converged() => {
                TerminationStatus::Terminated(TerminationReason::SolverConverged)
            }
            Some(ending) => {
                TerminationStatus::Terminated(TerminationReason::SolverExit(ending.to_string()))
            }
        }
    }
}
