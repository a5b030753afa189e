//! One iteration: steps are proposed and judged until one is worth taking, or none is needed.

use argmin::core::Problem as Counted;
use nalgebra::DVector;

use super::minimiser::{Minimiser, Point, Refusal, broken_off, felt_length};
use super::rescue::Verdict;
use super::restrict::{self, Proposal, Undamped, free_parameters};
use super::strategy::{Strategy, Trial};
use super::system::System;
use crate::linear::LinearModel;
use crate::options::Finish;
use crate::outcome::{Convergence, Ending, FitError, Iteration};

/// Least share of the promised fall that makes a step worth taking.
const LEAST_GAIN: f64 = 1e-4;

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

/// An undamped step that promises no more than this share of the cost is near the end.
const NEAR_END: f64 = 1e-9;

/// Where the undamped step is felt by no more than this share of the parameters, a step that fails
/// fails for the rounding of the cost: a wrong Jacobian leads astray long before.
const ROUNDING: f64 = 1e-12;

/// A step that changes the linear prediction of the residuals by no more than this share of it is a
/// few roundings.
const FEW_ROUNDINGS: f64 = 4.0 * f64::EPSILON;

/// Costs that differ by no more than this share are the same up to rounding.
const SAME_COST: f64 = 1e-12;

/// The undamped step from a point.
#[derive(Default)]
struct Full {
    /// The fall that it promises.
    promised: f64,
    /// ‖D s‖.
    length: f64,
    /// ‖N s‖.
    felt: f64,
    /// A parameter that it moves far.
    far: Option<usize>,
    /// Whether its effect is nothing beside what was felt of the parameters somewhere on the way.
    fades: bool,
    /// Where it leads; `None` where the point is at rest without it.
    reached: Option<DVector<f64>>,
}

/// How an iteration left things.
pub(super) enum Progress {
    Moved(Trial),
    Rescued,
    Rest(Convergence),
    Stuck(Ending),
}

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
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

    /// Whether the point is a minimum, to rounding or on the promise of the undamped step, and that step.
    fn at_rest(&self, point: &Point<M>) -> Result<(Option<Convergence>, Full), FitError> {
        let rest = |by| Ok((Some(by), Full::default()));
        if point.evaluation.cost == 0.0 {
            return rest(Convergence::Cost);
        }
        if self.largest_cosine(point) <= self.options.gradient_tolerance {
            return rest(Convergence::Gradient);
        }
        let proposal = self.undamped(point)?;
        let step = &proposal.step;
        let promised = point.model.predicted_reduction(step);
        let felt = felt_length(point, step);
        let full = Full {
            promised,
            length: self.scaled_length(step),
            felt,
            far: self.goes_far(step),
            fades: felt <= f64::EPSILON * self.longest,
            reached: None,
        };
        let rest = match self.options.finish {
            Finish::Promised => self.rests_on_promise(point, step, promised),
            Finish::Polish | Finish::Evaluated => self.rests_by_rounding(point, &full),
        };
        let reached = Some(proposal.parameters);
        Ok((rest, Full { reached, ..full }))
    }

    /// The test by which neither cost nor parameters can show that a point is no minimum.
    fn rests_by_rounding(&self, point: &Point<M>, full: &Full) -> Option<Convergence> {
        if full.promised.abs() <= Self::cost_rounding(point) {
            return Some(Convergence::Cost);
        }
        // Beside what the parameters have been, felt as they are felt here: after a start with residuals of
        // 1e16 times those of the minimum every step is nothing beside what was felt there.
        let nothing = full.felt <= f64::EPSILON * felt_length(point, &self.farthest);
        (full.far.is_none() && nothing).then_some(Convergence::Step)
    }

    /// The test by which the undamped step is the last: it promises next to nothing of the cost, or
    /// changes the residuals' linear prediction by a few roundings of it.
    fn rests_on_promise(
        &self,
        point: &Point<M>,
        step: &DVector<f64>,
        promised: f64,
    ) -> Option<Convergence> {
        if promised <= self.options.cost_tolerance * point.evaluation.cost {
            return Some(Convergence::Cost);
        }
        let size = point.model.image_norm(&point.parameters);
        let nothing = point.model.image_norm(step) <= FEW_ROUNDINGS * size;
        nothing.then_some(Convergence::Step)
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

    /// A parameter that a step moves by a good part of all that it has ever been, if there is one.
    fn goes_far(&self, step: &DVector<f64>) -> Option<usize> {
        (0..step.len()).find(|&j| step[j].abs() > FAR * self.farthest[j])
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
        let promised = full.promised;
        let cost = point.evaluation.cost;
        let negligible = self.options.cost_tolerance * cost;
        let parameter_length = felt_length(&point, &point.parameters);
        let lost_in_rounding = full.far.is_none() && full.felt <= ROUNDING * parameter_length;
        if promised <= NEAR_END * cost {
            self.strategy.near_end();
        }
        for tried in 0..MOST_TRIALS {
            if self.strategy.gives_up() {
                break;
            }
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
                    self.record(cost, &trial, false);
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
            if gain < LEAST_GAIN && !self.polishes(&trial, cost) {
                self.record(cost, &trial, false);
                if settled {
                    return Ok((point, Progress::Rest(Convergence::Cost)));
                }
                if lost_in_rounding {
                    return Ok((point, self.wall_or(Convergence::Step)));
                }
                self.strategy.rejected(&trial);
                continue;
            }
            self.record(evaluation.cost, &trial, true);
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
            Verdict::Flat => Ok((point, self.wall_or(Convergence::Cost))),
        }
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

    /// The parameter that runs away, if one does: residuals may vanish along a way that does not end.
    fn runs_away(&mut self, full: &Full) -> Option<usize> {
        let far = full.far.filter(|_| full.fades);
        self.fading = far.map_or(0, |_| self.fading + 1);
        far.filter(|_| self.fading > MOST_FADING)
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
