//! The loop: Gauss–Newton steps, damped where one fails.
//!
//! Levenberg (1944) and Marquardt (1963) with the gain ratio and damping schedule of Nielsen,
//! "Damping parameter in Marquardt's method", IMM-REP-1999-05, begun without damping: a model
//! whose many unknowns enter linearly needs none near its solution.

use super::evaluate::{Evaluation, evaluate};
use super::gathered::Gathered;
use super::problem::{Parameters, StructuredProblem};
use super::progress::{Iteration, Options, Parts, Progress};
use crate::linear::bordered::{Bordered, BorderedCovariance, Solved};
use crate::outcome::{Combination, Convergence, Ending};
use crate::problem::NoValue;

/// The state between two steps. [`minimise`] drives it; so does the `argmin` solver of this module.
#[derive(Debug, Clone)]
pub struct Minimiser {
    options: Options,
    at: Parameters,
    evaluation: Evaluation,
    gathered: Option<Gathered>,
    full: Option<Solved>,
    solved: Option<Solved>,
    scales: Option<(Vec<f64>, Vec<f64>)>,
    damping: f64,
    growth: f64,
    undamped_end: UndampedEnd,
    /// Why a step was refused a value though it changes the rows by little, until a full step is
    /// taken.
    refused: Option<String>,
    iterations: Vec<Iteration>,
}

/// What became of full steps near the end: where residuals are large they may lead away from a
/// minimum that damped steps approach.
#[derive(Debug, Clone, Copy, PartialEq)]
enum UndampedEnd {
    NotTried,
    Tried,
    LedAway,
}

/// The result of a minimisation.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The best point.
    pub parameters: Parameters,
    /// Cost there.
    pub cost: f64,
    /// How it ended.
    pub ending: Ending,
    /// One record a pass over the rows.
    pub iterations: Vec<Iteration>,
    evaluation: Evaluation,
    solved: Option<Solved>,
}

impl Fit {
    /// Whether the end is a minimum.
    pub fn converged(&self) -> bool {
        self.ending.is_converged()
    }

    /// Covariances for rows in units of their standard deviation; `None` where the fit did not
    /// reach a minimum that determines everything.
    pub fn covariance(&self) -> Option<BorderedCovariance> {
        let solved = self.solved.as_ref().filter(|_| self.converged())?;
        Some(BorderedCovariance::new(&self.evaluation.system, solved))
    }

    /// The value that held border unknowns would take if they were released too, to first order,
    /// with the variance of that for unit noise: is the model's fixed value right?
    pub fn if_released<P: StructuredProblem>(
        &self,
        problem: &P,
        release: usize,
    ) -> Option<(f64, f64)> {
        let (value, covariance) = self.released(problem, release)?;
        Some((value, covariance.border()[(release, release)]))
    }

    /// The value that a held border unknown would take if it were released too, to first order, and
    /// the covariance of all unknowns for unit noise then.
    pub fn released<P: StructuredProblem>(
        &self,
        problem: &P,
        release: usize,
    ) -> Option<(f64, BorderedCovariance)> {
        let mut held = problem.held().to_vec();
        *held.get_mut(release)? = false;
        let missing = problem
            .constraints()
            .missing(&self.parameters.band, &self.parameters.border);
        let solved = self
            .evaluation
            .system
            .solve(problem.constraints(), &missing, &held)
            .ok()?;
        if !solved.undetermined.is_empty() {
            return None;
        }
        Some((
            self.parameters.border[release] + solved.border[release],
            BorderedCovariance::new(&self.evaluation.system, &solved),
        ))
    }
}

/// A step that changes the rows by no more than this, relative to them, is a few roundings.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// A step that fails though it changes the rows by no more than this fails for the rounding of the
/// cost: a wrong Jacobian leads astray long before.
const FAILED_BY_ROUNDING: f64 = 1e-12;
/// Where a step that changes the rows by no more than this is refused a value, the wall is here.
const AT_WALL: f64 = 1e-6;
/// A step that promises no more than this share of the cost is near the end.
const NEAR: f64 = 1e-9;
/// Costs that differ by no more than this share are the same up to rounding.
const SAME_COST: f64 = 1e-12;
/// A damped step that promises nothing says that this is the end up to this damping; above it, the
/// damping itself may be why.
const LITTLE_DAMPING: f64 = 1.0;
/// First damping after a failed Gauss–Newton step, relative to the squared column norms.
const FIRST_DAMPING: f64 = 1e-3;
/// Damping below this is none.
const NO_DAMPING: f64 = 1e-9;
/// Damping above this means that no step helps.
const TOO_MUCH_DAMPING: f64 = 1e12;
/// A step is accepted when the cost falls by this share of the promise.
const ACCEPTED_GAIN: f64 = 1e-4;

impl Minimiser {
    /// Evaluates the start.
    ///
    /// # Errors
    /// [`NoValue`] if the model is not defined there.
    pub fn new<P: StructuredProblem>(
        problem: &P,
        start: Parameters,
        options: Options,
    ) -> Result<Self, NoValue> {
        check_lengths(problem, &start)?;
        let evaluation = evaluate(problem, &start)?;
        Ok(Self::at(start, evaluation, None, options))
    }

    /// Evaluates the start and keeps the compressed rows of the best point, so that parts of the
    /// rows can be given new weights ([`Self::reweigh`]) between two steps.
    ///
    /// # Errors
    /// [`NoValue`] if the model is not defined there.
    pub fn gathering<P: StructuredProblem>(
        problem: &P,
        start: Parameters,
        options: Options,
    ) -> Result<Self, NoValue> {
        let (evaluation, gathered) = gather(problem, &start)?;
        Ok(Self::at(start, evaluation, Some(gathered), options))
    }

    fn at(
        at: Parameters,
        evaluation: Evaluation,
        gathered: Option<Gathered>,
        options: Options,
    ) -> Self {
        Self {
            options,
            at,
            evaluation,
            gathered,
            full: None,
            solved: None,
            scales: None,
            damping: 0.0,
            growth: 2.0,
            undamped_end: UndampedEnd::NotTried,
            refused: None,
            iterations: Vec::new(),
        }
    }

    /// Multiplies the rows of each part by a factor, without a pass over them. The problem handed to
    /// [`Self::advance`] from then on must have the same weights.
    pub fn reweigh(&mut self, factors: &[f64]) {
        if let Some(gathered) = &mut self.gathered {
            gathered.reweigh(factors);
            self.evaluation = gathered.evaluation();
            (self.full, self.scales) = (None, None);
        }
    }

    /// What the full step from the best point would leave of each part of the rows, by the linear
    /// prediction; `None` where rows are not kept or do not determine the step.
    pub fn parts<P: StructuredProblem>(&mut self, problem: &P) -> Option<Parts> {
        let gathered = self.gathered.as_ref()?;
        let system = &self.evaluation.system;
        let step = match self.full.take() {
            Some(step) => step,
            None => {
                let missing = problem
                    .constraints()
                    .missing(&self.at.band, &self.at.border);
                system
                    .solve(problem.constraints(), &missing, problem.held())
                    .ok()?
            }
        };
        let predicted = system.predicted_reduction(&step.band, &step.border);
        let parts = step.undetermined.is_empty().then(|| Parts {
            predicted,
            last: self.settled_by(predicted, &step).is_some(),
            squares: gathered.squares_after(&step),
            traces: gathered.hat_traces(&BorderedCovariance::new(system, &step)),
        });
        self.full = Some(step);
        parts
    }

    /// The best point so far.
    pub fn parameters(&self) -> &Parameters {
        &self.at
    }

    /// Cost at the best point so far.
    pub fn cost(&self) -> f64 {
        self.evaluation.cost
    }

    /// The records so far.
    pub fn iterations(&self) -> &[Iteration] {
        &self.iterations
    }

    /// Takes one step: one pass over the rows, or none where the step is the last.
    pub fn advance<P: StructuredProblem>(&mut self, problem: &P) -> Progress {
        if self.evaluation.vanished || !self.evaluation.cost.is_finite() {
            return Progress::Done(Ending::OutOfRange);
        }
        let constraints = problem.constraints();
        let missing = constraints.missing(&self.at.band, &self.at.border);
        let system = &self.evaluation.system;
        let solved = if self.damping == 0.0 {
            match self.full.take() {
                Some(solved) => Ok(solved),
                None => system.solve(constraints, &missing, problem.held()),
            }
        } else {
            let scales = self.scales.get_or_insert_with(|| system.column_norms());
            system.damped(self.damping, &scales.0, &scales.1).solve(
                constraints,
                &missing,
                problem.held(),
            )
        };
        let solved = match solved {
            Ok(solved) => solved,
            // A constraint that repeats another determines nothing.
            Err(index) => {
                return Progress::Done(Ending::NotIdentifiable {
                    by: Convergence::Gradient,
                    combinations: vec![Combination {
                        terms: vec![(format!("constraint {index}"), 1.0)],
                    }],
                });
            }
        };
        let predicted = system.predicted_reduction(&solved.band, &solved.border);
        let cost = self.evaluation.cost;
        let trial = self.at.stepped(&solved.band, &solved.border);
        let settled = self.settled_by(predicted, &solved);
        let accepted = self.iterations.last().is_some_and(|i| i.accepted);
        let near = settled.is_some() || predicted <= NEAR * cost;
        if near && self.damping > 0.0 && accepted && self.undamped_end != UndampedEnd::LedAway {
            // The undamped step shows whether it is the end.
            self.damping = 0.0;
            self.undamped_end = UndampedEnd::Tried;
            return self.advance(problem);
        }
        if let (Some(by), true) = (settled, self.damping == 0.0) {
            let combinations = undetermined(problem, system, &solved);
            self.at = trial;
            self.evaluation.cost = (cost - predicted).max(0.0);
            self.record(predicted, true);
            self.solved = Some(solved);
            return Progress::Done(if combinations.is_empty() {
                Ending::Converged(by)
            } else {
                Ending::NotIdentifiable { by, combinations }
            });
        }
        if let Some(by) = settled.filter(|_| self.damping <= LITTLE_DAMPING) {
            // The undamped step has been tried and leads away from a minimum that damped ones found.
            return self.end_here(problem, by);
        }
        if self.iterations.len() >= self.options.max_iterations {
            return Progress::Done(Ending::IterationLimit);
        }
        let next = if self.gathered.is_some() {
            gather(problem, &trial).map(|(next, gathered)| (next, Some(gathered)))
        } else {
            evaluate(problem, &trial).map(|next| (next, None))
        };
        let refused = match &next {
            Ok((next, _)) if next.cost.is_finite() => None,
            Ok(_) => Some("the sum of squared residuals is not finite".to_string()),
            Err(no) => Some(no.reason.clone()),
        };
        if refused.is_some() && self.change(&solved) <= AT_WALL {
            self.refused = refused;
        }
        match next {
            Ok((next, gathered))
                if next.cost.is_finite()
                    && (cost - next.cost > ACCEPTED_GAIN * predicted
                        || self.polishes(predicted, next.cost)) =>
            {
                let gain = (cost - next.cost) / predicted;
                self.at = trial;
                (self.evaluation, self.gathered) = (next, gathered);
                self.full = None;
                self.record(predicted, true);
                if self.damping == 0.0 {
                    self.refused = None;
                }
                self.damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(0.1);
                self.growth = 2.0;
                if self.damping < NO_DAMPING {
                    self.damping = 0.0;
                }
            }
            _ => {
                let failed_by_rounding = self.change(&solved) <= FAILED_BY_ROUNDING;
                self.record(predicted, false);
                if self.damping == 0.0 && self.undamped_end == UndampedEnd::Tried {
                    self.undamped_end = UndampedEnd::LedAway;
                }
                let at_wall = self.refused.clone().map(|reason| Ending::AtWall { reason });
                if failed_by_rounding {
                    return match at_wall {
                        Some(ending) => Progress::Done(ending),
                        None => self.end_here(problem, Convergence::Step),
                    };
                }
                self.damping = if self.damping == 0.0 {
                    FIRST_DAMPING
                } else {
                    self.damping * self.growth
                };
                self.growth *= 2.0;
                if self.damping > TOO_MUCH_DAMPING {
                    return Progress::Done(at_wall.unwrap_or(Ending::NoDescent));
                }
            }
        }
        Progress::Continue
    }

    /// Ends at the best point so far.
    fn end_here<P: StructuredProblem>(&mut self, problem: &P, by: Convergence) -> Progress {
        let constraints = problem.constraints();
        let missing = constraints.missing(&self.at.band, &self.at.border);
        let system = &self.evaluation.system;
        let Ok(solved) = system.solve(constraints, &missing, problem.held()) else {
            return Progress::Done(Ending::NoDescent);
        };
        let combinations = undetermined(problem, system, &solved);
        self.solved = Some(solved);
        Progress::Done(if combinations.is_empty() {
            Ending::Converged(by)
        } else {
            Ending::NotIdentifiable { by, combinations }
        })
    }

    /// Why a step is the last, if it is.
    fn settled_by(&self, predicted: f64, step: &Solved) -> Option<Convergence> {
        if predicted <= self.options.cost_tolerance * self.evaluation.cost {
            Some(Convergence::Cost)
        } else if self.change(step) <= ROUNDING {
            Some(Convergence::Step)
        } else {
            None
        }
    }

    /// Whether a full step is worth taking though it is too small to show in the cost: the promises
    /// still fall.
    fn polishes(&self, predicted: f64, next: f64) -> bool {
        let cost = self.evaluation.cost;
        self.damping == 0.0
            && (next - cost).abs() <= SAME_COST * cost
            && self.iterations.last().is_some_and(|last| {
                last.accepted && last.damping == 0.0 && predicted < 0.5 * last.predicted
            })
    }

    /// By how much a step changes the rows, relative to what they are.
    fn change(&self, step: &Solved) -> f64 {
        let system = &self.evaluation.system;
        system.relative_change(step, &self.at.band, &self.at.border)
    }

    /// The result.
    pub fn finish(self, ending: Ending) -> Fit {
        Fit {
            parameters: self.at,
            cost: self.evaluation.cost,
            ending,
            iterations: self.iterations,
            evaluation: self.evaluation,
            solved: self.solved,
        }
    }

    fn record(&mut self, predicted: f64, accepted: bool) {
        self.iterations.push(Iteration {
            cost: self.evaluation.cost,
            predicted,
            damping: self.damping,
            accepted,
        });
    }
}

/// Refuses a point of a problem of another size.
fn check_lengths<P: StructuredProblem>(problem: &P, at: &Parameters) -> Result<(), NoValue> {
    let expected = (problem.band_count(), problem.border_count());
    let found = (at.band.len(), at.border.len());
    if found == expected {
        return Ok(());
    }
    Err(NoValue::new(format!(
        "the start has {} unknowns in the band and {} in the border, the problem {} and {}",
        found.0, found.1, expected.0, expected.1
    )))
}

fn gather<P: StructuredProblem>(
    problem: &P,
    at: &Parameters,
) -> Result<(Evaluation, Gathered), NoValue> {
    check_lengths(problem, at)?;
    let gathered = Gathered::new(problem, at)?;
    Ok((gathered.evaluation(), gathered))
}

/// Minimises from a start that satisfies the constraints.
///
/// # Errors
/// [`NoValue`] if the model is not defined at the start.
pub fn minimise<P: StructuredProblem>(
    problem: &P,
    start: Parameters,
    options: Options,
) -> Result<Fit, NoValue> {
    let mut minimiser = Minimiser::new(problem, start, options)?;
    loop {
        if let Progress::Done(ending) = minimiser.advance(problem) {
            return Ok(minimiser.finish(ending));
        }
    }
}

/// Diagonals of the band below this share of their column count as zero.
const BAND_RANK_TOLERANCE: f64 = 1e-11;

/// A share in an undetermined combination below this is rounding.
const NEGLIGIBLE_SHARE: f64 = 1e-6;

/// The combinations that the rows do not determine.
fn undetermined<P: StructuredProblem>(
    problem: &P,
    system: &Bordered,
    solved: &Solved,
) -> Vec<Combination> {
    let in_border = solved.undetermined.iter().map(|u| {
        let largest = u.weights.iter().fold(0.0_f64, |m, w| m.max(w.abs()));
        let terms = u
            .weights
            .iter()
            .enumerate()
            .filter(|(_, w)| w.abs() > NEGLIGIBLE_SHARE * largest)
            .map(|(j, w)| (problem.border_name(j), *w))
            .collect();
        Combination { terms }
    });
    let in_band = system
        .triangle()
        .undetermined(BAND_RANK_TOLERANCE)
        .into_iter()
        .map(|j| Combination {
            terms: vec![(problem.band_name(j), 1.0)],
        });
    in_border.chain(in_band).collect()
}
