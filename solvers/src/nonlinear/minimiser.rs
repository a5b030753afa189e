//! The loop that every method shares, as an argmin `Solver`.
//!
//! One iteration: linearise, ask the strategy for steps until one lowers the cost by a fair share
//! of what the linear model promised, and look whether a minimum is reached. Around a minimum
//! the polish takes over.

use argmin::core::{
    IterState, KV, Problem as Counted, Solver, State, TerminationReason, TerminationStatus,
};
use argmin::kv;
use nalgebra::DVector;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::descend::Progress;
use super::strategy::Strategy;
use super::system::{Evaluation, System};
use crate::linear::LinearModel;
use crate::options::{Finish, Options};
use crate::outcome::{Ending, FitError, Iteration};

/// The state that argmin's executor, observers and checkpoints see: parameters, cost, gradient.
pub type FitState = IterState<DVector<f64>, DVector<f64>, (), (), DVector<f64>, f64>;

/// The least-squares loop with a strategy `S` and linear models `M`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "S: Serialize + DeserializeOwned")]
pub struct Minimiser<S, M> {
    pub(super) strategy: S,
    pub(super) options: Options,
    /// D: the largest norm that each column of the Jacobian has had (Moré 1978, eq. 6.3).
    pub(super) scale: DVector<f64>,
    /// The largest ‖N p‖ so far, N the column norms of the Jacobian at p.
    pub(super) longest: f64,
    /// The largest magnitude that each parameter has had.
    pub(super) farthest: DVector<f64>,
    /// The power of two in which residuals are counted.
    pub(crate) unit: f64,
    /// The shortest step that was refused a value, until one about as long as the undamped step is
    /// taken.
    pub(super) refused: Option<Refusal>,
    /// Iterations in a row whose undamped step has no effect beside what parameters once had, but moves
    /// one of them far.
    pub(super) fading: usize,
    pub(crate) history: Vec<Iteration>,
    ending: Option<Ending>,
    #[serde(skip)]
    pub(crate) point: Option<Point<M>>,
}

/// A point at which the system has been evaluated and linearised.
#[derive(Debug, Clone)]
pub(crate) struct Point<M> {
    pub parameters: DVector<f64>,
    pub evaluation: Evaluation<M>,
    pub model: M,
}

/// A step that was refused a value.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Refusal {
    pub reason: String,
    /// Its length as a share of the parameters' greatest.
    pub share: f64,
}

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
    /// A minimiser that has not begun.
    pub fn new(strategy: S, options: Options) -> Self {
        Self {
            strategy,
            options,
            scale: DVector::zeros(0),
            longest: 0.0,
            farthest: DVector::zeros(0),
            unit: 1.0,
            refused: None,
            fading: 0,
            history: Vec::new(),
            ending: None,
            point: None,
        }
    }

    /// Why the minimiser ended; `None` while it has not, or when something else ended the run.
    pub fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    /// Linearises at parameters whose evaluation is known.
    pub(super) fn arrive<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        parameters: DVector<f64>,
        mut evaluation: Evaluation<M>,
    ) -> Result<Point<M>, FitError> {
        let mut made = None;
        problem
            .problem("jacobian_count", |system| {
                made = Some(system.linearize(&parameters, &mut evaluation, self.unit));
                Ok(())
            })
            .map_err(broken_off)?;
        let model = made.ok_or_else(no_answer)??;
        Ok(Point {
            parameters,
            evaluation,
            model,
        })
    }

    /// Cost and residuals; the reason where the model has no value or its cost no finite one.
    pub(super) fn evaluate<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        parameters: &DVector<f64>,
    ) -> Result<Result<Evaluation<M>, String>, FitError> {
        let evaluation = self.residuals(problem, parameters)?;
        Ok(evaluation.and_then(|evaluation| {
            if evaluation.cost.is_finite() {
                Ok(evaluation)
            } else {
                Err("the sum of squared residuals is not finite".to_string())
            }
        }))
    }

    pub(super) fn residuals<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        parameters: &DVector<f64>,
    ) -> Result<Result<Evaluation<M>, String>, FitError> {
        problem
            .problem("residual_count", |system| {
                Ok(system
                    .evaluate(parameters, self.unit)
                    .map_err(|no| no.reason))
            })
            .map_err(broken_off)
    }

    /// Keeps D at the largest column norms seen; a column that has always been zero gets 1.
    fn rescale(&mut self, point: &Point<M>) {
        let norms = point.model.column_norms();
        if self.scale.len() != norms.len() {
            self.scale = norms.map(|norm| if norm > 0.0 { norm } else { 1.0 });
        } else {
            self.scale.zip_apply(norms, |d, norm| *d = d.max(norm));
        }
        self.longest = self.longest.max(felt_length(point, &point.parameters));
        if self.farthest.len() != norms.len() {
            self.farthest = point.parameters.abs();
        } else {
            self.farthest
                .zip_apply(&point.parameters, |f, p| *f = f.max(p.abs()));
        }
    }

    pub(super) fn scaled_length(&self, vector: &DVector<f64>) -> f64 {
        vector.component_mul(&self.scale).norm()
    }

    fn iterate<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        point: Point<M>,
    ) -> Result<(Point<M>, KV), FitError> {
        let (point, progress) = self.descend(problem, point)?;
        self.rescale(&point);
        match progress {
            Progress::Moved(trial) => Ok((
                point,
                kv!(
                    "step" => trial.length;
                    "gain" => trial.gain();
                    "damping" => self.strategy.damping();
                ),
            )),
            Progress::Rescued => {
                // The strategy's idea of a good step has failed: it starts afresh.
                self.strategy.begin(self.scaled_length(&point.parameters));
                Ok((point, KV::new()))
            }
            Progress::Stuck(ending) => {
                self.ending = Some(ending);
                Ok((point, KV::new()))
            }
            Progress::Rest(by) => {
                let (point, by) = if self.options.finish == Finish::Polish {
                    self.polish(problem, point, by)?
                } else {
                    (point, by)
                };
                self.ending = Some(self.at_minimum(problem, &point, by)?);
                Ok((point, KV::new()))
            }
        }
    }

    fn show(&mut self, state: FitState, point: Point<M>) -> FitState {
        let mut state = state
            .param(point.parameters.clone())
            .cost(point.evaluation.cost * self.unit * self.unit)
            .gradient(point.model.gradient() * self.unit * self.unit);
        self.point = Some(point);
        state = match &self.ending {
            Some(ending) if ending.is_minimum() => {
                state.terminate_with(TerminationReason::SolverConverged)
            }
            Some(other) => state.terminate_with(TerminationReason::SolverExit(other.to_string())),
            None => state,
        };
        state
    }
}

impl<O, S, M> Solver<O, FitState> for Minimiser<S, M>
where
    O: System<Model = M>,
    S: Strategy + Serialize + DeserializeOwned,
    M: LinearModel,
{
    fn name(&self) -> &str {
        self.strategy.name()
    }

    fn init(
        &mut self,
        problem: &mut Counted<O>,
        mut state: FitState,
    ) -> Result<(FitState, Option<KV>), argmin::core::Error> {
        let start = state.take_param().ok_or(FitError::NoParameters)?;
        let point = self.start(problem, start)?;
        self.rescale(&point);
        self.strategy.begin(self.scaled_length(&point.parameters));
        Ok((self.show(state, point), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Counted<O>,
        mut state: FitState,
    ) -> Result<(FitState, Option<KV>), argmin::core::Error> {
        // A run continued from a checkpoint carries parameters only.
        let point = match self.point.take() {
            Some(point) => point,
            None => {
                let parameters = state.take_param().ok_or(FitError::NoParameters)?;
                self.resume(problem, parameters)?
            }
        };
        let (point, report) = self.iterate(problem, point)?;
        Ok((self.show(state, point), Some(report)))
    }

    fn terminate(&mut self, _state: &FitState) -> TerminationStatus {
        let raised = self
            .options
            .stop
            .as_ref()
            .is_some_and(|flag| flag.load(std::sync::atomic::Ordering::Relaxed));
        if raised {
            return TerminationStatus::Terminated(TerminationReason::Interrupt);
        }
        TerminationStatus::NotTerminated
    }
}

/// ‖N v‖ with the column norms N of the Jacobian at the point: how far the residuals would be
/// moved by each entry of v alone. A parameter that has lost its effect does not count.
pub(super) fn felt_length<M: LinearModel>(point: &Point<M>, vector: &DVector<f64>) -> f64 {
    vector.component_mul(point.model.column_norms()).norm()
}

/// An argmin error back as ours: either our own on its way through, or that of an observer.
pub(crate) fn broken_off(error: argmin::core::Error) -> FitError {
    error
        .downcast::<FitError>()
        .unwrap_or_else(|other| FitError::BrokenOff {
            reason: other.to_string(),
        })
}

fn no_answer() -> FitError {
    FitError::BrokenOff {
        reason: "the problem was taken away during the run".to_string(),
    }
}
