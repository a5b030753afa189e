//! One iteration: steps are proposed and judged until one is worth taking, or none is needed.

use argmin::core::Problem as Counted;

use super::at_rest::Full;
use super::minimiser::{Minimiser, Point, Refusal, broken_off, felt_length};
use super::rescue::Verdict;
use super::restrict::{self, Proposal};
use super::strategy::{Strategy, Trial};
use super::system::{Evaluation, System};
use crate::linear::LinearModel;
use crate::options::Finish;
use crate::outcome::{Convergence, Ending, FitError, Iteration};

/// Least share of the promised fall that makes a step worth taking.
const LEAST_GAIN: f64 = 1e-4;

/// A step of this share of the undamped one was not held up by a wall.
const UNIMPEDED: f64 = 0.5;

/// Where a step of this share of the parameters is refused a value, the wall is here. Far steps may
/// well be refused on the way to a minimum.
const AT_WALL: f64 = 1e-6;

/// Steps tried from one point before giving up: each failure shortens the step at least by half.
const MOST_TRIALS: usize = 100;

/// An undamped step that promises no more than this share of the cost is near the end.
const NEAR_END: f64 = 1e-9;

/// Where the undamped step is felt by no more than this share of the parameters, a step that fails
/// fails for the rounding of the cost: a wrong Jacobian leads astray long before.
const ROUNDING: f64 = 1e-12;

/// Costs that differ by no more than this share are the same up to rounding.
const SAME_COST: f64 = 1e-12;

/// How an iteration left things.
pub(super) enum Progress {
    Moved(Trial),
    Rescued,
    Rest(Convergence),
    Stuck(Ending),
}

/// What became of a step.
enum Tried<M> {
    /// It failed: another one is to be tried.
    Failed,
    /// There is no other one to try.
    Nothing,
    /// It failed, and the point is the last.
    Ends(Progress),
    /// It was taken.
    Taken(Point<M>, Progress),
}

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
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

    /// Whether an undamped step that is to be followed by a last one is worth taking though it is too
    /// small to show in the cost: the promises still fall.
    fn polishes(&self, trial: &Trial, cost: f64) -> bool {
        self.options.finish == Finish::Promised
            && self.strategy.damping() == 0.0
            && trial.actual.abs() <= SAME_COST * cost
            && self.history.last().is_some_and(|last| {
                let before = last.predicted / (self.unit * self.unit);
                last.accepted && last.damping == 0.0 && trial.predicted < 0.5 * before
            })
    }

    /// One iteration: tries steps from `point` until one is worth taking.
    pub(super) fn descend<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        point: Point<M>,
    ) -> Result<(Point<M>, Progress), FitError> {
        if point.evaluation.out_of_range {
            return Ok((point, Progress::Stuck(Ending::OutOfRange)));
        }
        let (rest, full) = self.at_rest(&point)?;
        if let Some(by) = rest {
            let last = if self.options.finish == Finish::Promised {
                self.take_promised(point, full)
            } else {
                point
            };
            return Ok((last, Progress::Rest(by)));
        }
        if let Some(j) = self.runs_away(&full) {
            let parameter = Self::name_of(problem, j)?;
            return Ok((point, Progress::Stuck(Ending::RunsAway { parameter })));
        }
        if full.promised <= NEAR_END * point.evaluation.cost {
            self.strategy.near_end();
        }
        for tried in 0..MOST_TRIALS {
            match self.attempt(problem, &point, &full, tried == 0)? {
                Tried::Failed => {}
                Tried::Nothing => break,
                Tried::Ends(progress) => return Ok((point, progress)),
                Tried::Taken(next, progress) => return Ok((next, progress)),
            }
        }
        self.without_descent(problem, point, full.promised)
    }

    /// Proposes a step and, where it promises anything, has it judged.
    fn attempt<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        point: &Point<M>,
        full: &Full,
        first: bool,
    ) -> Result<Tried<M>, FitError> {
        if self.strategy.gives_up() {
            return Ok(Tried::Nothing);
        }
        let proposal = self.propose(problem, point)?;
        let step = &proposal.step;
        let length = self.scaled_length(step);
        if !length.is_finite() {
            self.strategy.invalid(f64::MAX);
            return Ok(Tried::Failed);
        }
        if length == 0.0 {
            return Ok(Tried::Nothing);
        }
        let trial = Trial {
            actual: f64::NEG_INFINITY,
            predicted: point.model.predicted_reduction(step),
            length,
            slope: point.model.gradient().dot(step),
        };
        if trial.predicted <= 0.0 {
            self.strategy.rejected(&trial);
            return Ok(Tried::Failed);
        }
        match self.evaluate(problem, &proposal.parameters)? {
            Ok(evaluation) => {
                let trial = Trial {
                    actual: point.evaluation.cost - evaluation.cost,
                    ..trial
                };
                self.judge(problem, (point, full, first), trial, (proposal, evaluation))
            }
            Err(reason) => {
                let share = length / self.reach(full);
                if self.refused.as_ref().is_none_or(|r| share < r.share) {
                    self.refused = Some(Refusal { reason, share });
                }
                self.record(point.evaluation.cost, &trial, false);
                self.strategy.invalid(length);
                Ok(Tried::Failed)
            }
        }
    }

    /// Takes a step or turns it down by what it brought, and looks whether it is the last.
    fn judge<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        (point, full, first): (&Point<M>, &Full, bool),
        trial: Trial,
        (proposal, evaluation): (Proposal, Evaluation<M>),
    ) -> Result<Tried<M>, FitError> {
        let cost = point.evaluation.cost;
        let negligible = self.options.cost_tolerance * cost;
        let parameter_length = felt_length(point, &point.parameters);
        let near = full.promised <= self.options.cost_tolerance.sqrt() * cost;
        let gain = trial.gain();
        let settled = trial.actual.abs() <= negligible
            && trial.predicted <= negligible
            && gain <= 2.0
            && near;
        if gain < LEAST_GAIN && !self.polishes(&trial, cost) {
            self.record(cost, &trial, false);
            if settled {
                return Ok(Tried::Ends(Progress::Rest(Convergence::Cost)));
            }
            if full.far.is_none() && full.felt <= ROUNDING * parameter_length {
                return Ok(Tried::Ends(self.wall_or(Convergence::Step)));
            }
            self.strategy.rejected(&trial);
            return Ok(Tried::Failed);
        }
        self.record(evaluation.cost, &trial, true);
        self.strategy.accepted(&trial);
        let felt = felt_length(point, &proposal.step);
        let short = first && gain > 0.25 && felt <= self.options.step_tolerance * parameter_length;
        if trial.length >= UNIMPEDED * full.length {
            self.refused = None;
        }
        let next = self.arrive(problem, proposal.parameters, evaluation)?;
        let progress = match (settled, short, self.at_wall()) {
            (true, ..) => Progress::Rest(Convergence::Cost),
            (_, true, Some(wall)) if !near => Progress::Stuck(wall),
            (_, true, _) => Progress::Rest(Convergence::Step),
            _ => Progress::Moved(trial),
        };
        Ok(Tried::Taken(next, progress))
    }

    /// Where every step has failed: flat, a wall, a wrong Jacobian, or a way out.
    fn without_descent<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        point: Point<M>,
        promised: f64,
    ) -> Result<(Point<M>, Progress), FitError> {
        if promised <= self.options.cost_tolerance * point.evaluation.cost {
            return Ok((point, Progress::Rest(Convergence::Cost)));
        }
        Ok(match self.rescue(problem, &point)? {
            Verdict::Better(parameters, evaluation) => {
                let next = self.arrive(problem, parameters, evaluation)?;
                (next, Progress::Rescued)
            }
            Verdict::NoValue(reason) => (point, Progress::Stuck(Ending::AtWall { reason })),
            Verdict::WrongJacobian => (point, Progress::Stuck(Ending::NoDescent)),
            Verdict::Flat => (point, self.wall_or(Convergence::Cost)),
        })
    }

    /// ‖D p‖ for the greatest magnitudes that parameters have had; before any has left zero, the
    /// undamped step's length.
    fn reach(&self, full: &Full) -> f64 {
        let reach = self.scaled_length(&self.farthest);
        if reach > 0.0 { reach } else { full.length }
    }

    /// At rest by this test, unless a wall is here.
    fn wall_or(&self, by: Convergence) -> Progress {
        self.at_wall().map_or(Progress::Rest(by), Progress::Stuck)
    }

    /// Takes the undamped step on its promise; model and residuals stay those of the point before.
    fn take_promised(&mut self, mut point: Point<M>, full: Full) -> Point<M> {
        if let Some(reached) = full.reached {
            let cost = (point.evaluation.cost - full.promised).max(0.0);
            (point.parameters, point.evaluation.cost) = (reached, cost);
            self.history.push(Iteration {
                cost: cost * self.unit * self.unit,
                predicted: full.promised * self.unit * self.unit,
                damping: 0.0,
                accepted: true,
            });
        }
        point
    }

    /// Notes what became of a step: `cost` is that of the best point then.
    fn record(&mut self, cost: f64, trial: &Trial, accepted: bool) {
        self.history.push(Iteration {
            cost: cost * self.unit * self.unit,
            predicted: trial.predicted * self.unit * self.unit,
            damping: self.strategy.damping(),
            accepted,
        });
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
}
