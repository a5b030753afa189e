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

use super::rescue::Verdict;
use super::restrict::{self, Proposal, Undamped, free_parameters};
use super::strategy::{Strategy, Trial};
use super::system::{Evaluation, System};
use crate::linear::LinearModel;
use crate::options::Options;
use crate::outcome::{Convergence, Ending, FitError};

/// The state that argmin's executor, observers and checkpoints see: parameters, cost, gradient.
pub type FitState = IterState<DVector<f64>, DVector<f64>, (), (), DVector<f64>, f64>;

/// Least share of the promised fall that makes a step worth taking.
const LEAST_GAIN: f64 = 1e-4;

/// Below this cost residuals are counted in another unit: squares a hundred decades smaller, as those
/// of single residuals and of steps near the minimum are, still have all their digits.
const LEAST_COST: f64 = 1e-200;

/// A step that moves a parameter by more than this share of all that it has ever been ends nothing,
/// however little the residuals change: roots up to the tenth order are approached by less.
const FAR: f64 = 1e-2;

/// Iterations in a row that go on so before a parameter is said to run away.
const MOST_FADING: usize = 30;

/// A step of this share of the undamped one was not held up by a wall.
const UNIMPEDED: f64 = 0.5;

/// Where a step of this share of the parameters is refused a value, the wall is here. Far steps may
/// well be refused on the way to a minimum.
const AT_WALL: f64 = 1e-6;

/// Steps tried from one point before giving up: each failure shortens the step at least by half.
const MOST_TRIALS: usize = 100;

/// The least-squares loop with a strategy `S` and linear models `M`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "S: Serialize + DeserializeOwned")]
pub struct Minimiser<S, M> {
    pub(super) strategy: S,
    pub(super) options: Options,
    /// D: the largest norm that each column of the Jacobian has had (Moré 1978, eq. 6.3).
    pub(super) scale: DVector<f64>,
    /// The largest ‖N p‖ so far, N the column norms of the Jacobian at p.
    longest: f64,
    /// The largest magnitude that each parameter has had.
    farthest: DVector<f64>,
    /// The power of two in which residuals are counted.
    pub(crate) unit: f64,
    /// The shortest step that was refused a value, until one about as long as the undamped step is
    /// taken.
    refused: Option<Refusal>,
    /// Iterations in a row whose undamped step has no effect beside what parameters once had, but moves
    /// one of them far.
    fading: usize,
    ending: Option<Ending>,
    #[serde(skip)]
    pub(crate) point: Option<Point<M>>,
}

/// A point at which the system has been evaluated and linearised.
#[derive(Debug, Clone)]
pub(crate) struct Point<M> {
    pub parameters: DVector<f64>,
    pub evaluation: Evaluation,
    pub model: M,
}

/// The undamped step from a point.
#[derive(Default)]
struct Full {
    /// The fall that it promises.
    promised: f64,
    /// ‖D s‖.
    length: f64,
    /// A parameter that it moves far.
    far: Option<usize>,
    /// Whether its effect is nothing beside what was felt of the parameters somewhere on the way.
    fades: bool,
}

/// A step that was refused a value.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Refusal {
    reason: String,
    /// Its length as a share of the parameters' greatest.
    share: f64,
}

/// How an iteration left things.
enum Progress {
    Moved(Trial),
    Rescued,
    Rest(Convergence),
    Stuck(Ending),
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
        evaluation: Evaluation,
    ) -> Result<Point<M>, FitError> {
        let mut made = None;
        problem
            .problem("jacobian_count", |system| {
                made = Some(system.linearize(&parameters, &evaluation, self.unit));
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
    ) -> Result<Result<Evaluation, String>, FitError> {
        let evaluation = self.residuals(problem, parameters)?;
        Ok(evaluation.and_then(|evaluation| {
            if evaluation.cost.is_finite() {
                Ok(evaluation)
            } else {
                Err("the sum of squared residuals overflows".to_string())
            }
        }))
    }

    fn residuals<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        parameters: &DVector<f64>,
    ) -> Result<Result<Evaluation, String>, FitError> {
        problem
            .problem("residual_count", |system| {
                Ok(system
                    .evaluate(parameters, self.unit)
                    .map_err(|no| no.reason))
            })
            .map_err(broken_off)
    }

    /// The system's number of parameters.
    fn expected<O: System<Model = M>>(problem: &mut Counted<O>) -> Result<usize, FitError> {
        let mut expected = 0;
        problem
            .problem("name_count", |system| {
                expected = system.parameter_count();
                Ok(())
            })
            .map_err(broken_off)?;
        Ok(expected)
    }

    /// Evaluates the start and chooses the unit in which residuals are counted.
    fn start<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        parameters: DVector<f64>,
    ) -> Result<Point<M>, FitError> {
        let (expected, found) = (Self::expected(problem)?, parameters.len());
        if found != expected {
            return Err(FitError::StartLength { expected, found });
        }
        let refused = |reason| FitError::NoValueAtStart { reason };
        self.unit = 1.0;
        let plain = self.residuals(problem, &parameters)?.map_err(refused)?;
        let largest = plain.residuals.amax();
        if plain.cost.is_finite() && (plain.cost > LEAST_COST || largest == 0.0) {
            return self.arrive(problem, parameters, plain);
        }
        self.unit = largest.log2().floor().exp2();
        let counted = self.evaluate(problem, &parameters)?.map_err(refused)?;
        match self.arrive(problem, parameters.clone(), counted) {
            // Residuals that vanish beside their derivatives need no other unit.
            Err(FitError::JacobianNotFinite { .. }) if plain.cost.is_finite() => {
                self.unit = 1.0;
                self.arrive(problem, parameters, plain)
            }
            other => other,
        }
    }

    /// Goes on from the parameters of a checkpoint.
    fn resume<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        parameters: DVector<f64>,
    ) -> Result<Point<M>, FitError> {
        let expected = Self::expected(problem)?;
        self.check_lengths(expected, &parameters)?;
        match self.evaluate(problem, &parameters)? {
            Ok(evaluation) => self.arrive(problem, parameters, evaluation),
            Err(reason) => Err(FitError::NoValueAtStart { reason }),
        }
    }

    /// Whether what a checkpoint holds is for as many parameters as the problem has.
    pub(crate) fn check_lengths(
        &self,
        expected: usize,
        parameters: &DVector<f64>,
    ) -> Result<(), FitError> {
        let bounds = self.options.bounds.as_ref();
        let lengths = [parameters.len(), self.scale.len(), self.farthest.len()]
            .into_iter()
            .chain(bounds.map(|b| b.lower().len()))
            .chain(bounds.map(|b| b.upper().len()));
        match lengths.into_iter().find(|&found| found != expected) {
            Some(found) => Err(FitError::CheckpointLength { expected, found }),
            None => Ok(()),
        }
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

    pub(super) fn undamped(&self, point: &Point<M>) -> Result<Proposal, FitError> {
        restrict::propose(
            &point.model,
            &self.scale,
            &point.parameters,
            self.options.bounds.as_ref(),
            Undamped,
        )
    }

    /// The strategy's step, with the geodesic correction where asked for.
    fn propose<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        point: &Point<M>,
    ) -> Result<Proposal, FitError> {
        let bounds = self.options.bounds.as_ref();
        let mut proposal = restrict::propose(
            &point.model,
            &self.scale,
            &point.parameters,
            bounds,
            &mut self.strategy,
        )?;
        // On a face of the box the correction would have to be projected again: it is left out.
        if self.options.geodesic_acceleration
            && bounds.is_none()
            && let Some(correction) = self.acceleration(problem, point, &proposal.step)?
        {
            proposal.parameters += correction;
        }
        Ok(proposal)
    }

    /// The rounding of the cost: that of the residuals times the residuals. A residual is a
    /// difference whose terms are about as large as J p.
    pub(super) fn cost_rounding(point: &Point<M>) -> f64 {
        let size: f64 = point
            .model
            .column_norms()
            .iter()
            .zip(point.parameters.iter())
            .map(|(norm, p)| norm * p.abs())
            .sum();
        let residual = (2.0 * point.evaluation.cost).sqrt();
        f64::EPSILON * residual * (residual + size)
    }

    /// The largest cosine between the residuals and a column of a free parameter.
    fn largest_cosine(&self, point: &Point<M>) -> f64 {
        let residual = (2.0 * point.evaluation.cost).sqrt();
        let gradient = point.model.gradient();
        let norms = point.model.column_norms();
        free_parameters(self.options.bounds.as_ref(), &point.parameters, gradient)
            .into_iter()
            .filter(|&j| norms[j] > 0.0)
            .map(|j| gradient[j].abs() / (norms[j] * residual))
            .fold(0.0, f64::max)
    }

    /// Whether the point is a minimum to rounding, and the undamped step with the fall it promises.
    fn at_rest(&self, point: &Point<M>) -> Result<(Option<Convergence>, Full), FitError> {
        let rest = |by| Ok((Some(by), Full::default()));
        if point.evaluation.cost == 0.0 {
            return rest(Convergence::Cost);
        }
        if self.largest_cosine(point) <= self.options.gradient_tolerance {
            return rest(Convergence::Gradient);
        }
        let step = self.undamped(point)?.step;
        let full = Full {
            promised: point.model.predicted_reduction(&step),
            length: self.scaled_length(&step),
            far: self.goes_far(&step),
            fades: false,
        };
        if full.promised.abs() <= Self::cost_rounding(point) {
            return rest(Convergence::Cost);
        }
        let felt = felt_length(point, &step);
        let full = Full {
            fades: felt <= f64::EPSILON * self.longest,
            ..full
        };
        // Beside what the parameters have been, felt as they are felt here: after a start with residuals of
        // 1e16 times those of the minimum every step is nothing beside what was felt there.
        if full.far.is_none() && felt <= f64::EPSILON * felt_length(point, &self.farthest) {
            return Ok((Some(Convergence::Step), full));
        }
        Ok((None, full))
    }

    /// A parameter that a step moves by a good part of all that it has ever been, if there is one.
    fn goes_far(&self, step: &DVector<f64>) -> Option<usize> {
        (0..step.len()).find(|&j| step[j].abs() > FAR * self.farthest[j])
    }

    /// One iteration: tries steps from `point` until one is worth taking.
    fn descend<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        point: Point<M>,
    ) -> Result<(Point<M>, Progress), FitError> {
        // After a start whose squares overflow, what is left may vanish in the unit that it needed.
        let vanished = point.evaluation.cost == 0.0 && point.evaluation.residuals.amax() > 0.0;
        if vanished && self.unit > 1.0 {
            return Ok((point, Progress::Stuck(Ending::OutOfRange)));
        }
        let (rest, full) = self.at_rest(&point)?;
        if let Some(by) = rest {
            return Ok((point, Progress::Rest(by)));
        }
        // Residuals may vanish along a way that does not end.
        match full.far.filter(|_| full.fades) {
            None => self.fading = 0,
            Some(_) if self.fading < MOST_FADING => self.fading += 1,
            Some(j) => {
                let parameter = Self::name_of(problem, j)?;
                return Ok((point, Progress::Stuck(Ending::RunsAway { parameter })));
            }
        }
        let promised = full.promised;
        let cost = point.evaluation.cost;
        let negligible = self.options.cost_tolerance * cost;
        let parameter_length = felt_length(&point, &point.parameters);
        for tried in 0..MOST_TRIALS {
            let proposal = self.propose(problem, &point)?;
            let step = &proposal.step;
            let length = self.scaled_length(step);
            if !length.is_finite() {
                self.strategy.invalid(f64::MAX);
                continue;
            }
            if length == 0.0 {
                break;
            }
            let mut trial = Trial {
                actual: f64::NEG_INFINITY,
                predicted: point.model.predicted_reduction(step),
                length,
                slope: point.model.gradient().dot(step),
            };
            if trial.predicted <= 0.0 {
                self.strategy.rejected(&trial);
                continue;
            }
            let evaluation = match self.evaluate(problem, &proposal.parameters)? {
                Ok(evaluation) => evaluation,
                Err(reason) => {
                    let share = length / self.reach(&full);
                    if self.refused.as_ref().is_none_or(|r| share < r.share) {
                        self.refused = Some(Refusal { reason, share });
                    }
                    self.strategy.invalid(length);
                    continue;
                }
            };
            trial.actual = cost - evaluation.cost;
            let gain = trial.gain();
            let near = promised <= self.options.cost_tolerance.sqrt() * cost;
            let settled = trial.actual.abs() <= negligible
                && trial.predicted <= negligible
                && gain <= 2.0
                && near;
            if gain < LEAST_GAIN {
                if settled {
                    return Ok((point, Progress::Rest(Convergence::Cost)));
                }
                self.strategy.rejected(&trial);
                continue;
            }
            self.strategy.accepted(&trial);
            let short = tried == 0
                && gain > 0.25
                && felt_length(&point, step) <= self.options.step_tolerance * parameter_length;
            if length >= UNIMPEDED * full.length {
                self.refused = None;
            }
            let next = self.arrive(problem, proposal.parameters, evaluation)?;
            let progress = match (settled, short, self.at_wall()) {
                (true, ..) => Progress::Rest(Convergence::Cost),
                (_, true, Some(wall)) if !near => Progress::Stuck(wall),
                (_, true, _) => Progress::Rest(Convergence::Step),
                _ => Progress::Moved(trial),
            };
            return Ok((next, progress));
        }
        if promised <= negligible {
            return Ok((point, Progress::Rest(Convergence::Cost)));
        }
        match self.rescue(problem, &point)? {
            Verdict::Better(parameters, evaluation) => {
                let next = self.arrive(problem, parameters, evaluation)?;
                Ok((next, Progress::Rescued))
            }
            Verdict::NoValue(reason) => Ok((point, Progress::Stuck(Ending::AtWall { reason }))),
            Verdict::WrongJacobian => Ok((point, Progress::Stuck(Ending::NoDescent))),
            Verdict::Flat => Ok((
                point,
                self.at_wall()
                    .map_or(Progress::Rest(Convergence::Cost), Progress::Stuck),
            )),
        }
    }

    /// ‖D p‖ for the greatest magnitudes that parameters have had; before any has left zero, the
    /// undamped step's length.
    fn reach(&self, full: &Full) -> f64 {
        let reach = self.scaled_length(&self.farthest);
        if reach > 0.0 { reach } else { full.length }
    }

    /// The ending, where steps were refused a value however short they were.
    fn at_wall(&self) -> Option<Ending> {
        let refusal = self.refused.as_ref().filter(|r| r.share <= AT_WALL)?;
        Some(Ending::AtWall {
            reason: refusal.reason.clone(),
        })
    }

    fn name_of<O: System<Model = M>>(
        problem: &mut Counted<O>,
        index: usize,
    ) -> Result<String, FitError> {
        let mut name = String::new();
        problem
            .problem("name_count", |system| {
                name = system.parameter_name(index);
                Ok(())
            })
            .map_err(broken_off)?;
        Ok(name)
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
                let (point, by) = if self.options.polish {
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
