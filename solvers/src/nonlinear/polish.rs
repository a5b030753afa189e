//! The last digits: undamped steps until their effect no longer falls.
//!
//! Near a minimum the cost is flat: steps below √ε of the parameters change it by less than its
//! own rounding, so that a gain ratio can no longer judge them and parameters end with half their
//! digits. The gradient is not flat there. The polish therefore judges a step by the size ‖J s‖ of
//! the next one, and stops where rounding of the residuals keeps that from falling. In that norm
//! the undamped iteration contracts from the first step on, because its matrix −(JᵀJ)⁻¹ Σ rᵢ∇²rᵢ
//! is symmetric in the metric JᵀJ; in any other it may grow before it shrinks.

use argmin::core::Problem as Counted;

use super::minimiser::{Minimiser, Point, felt_length};
use super::strategy::Strategy;
use super::system::System;
use crate::linear::LinearModel;
use crate::outcome::{Convergence, FitError};

/// Steps at most; a problem that contracts by nine tenths a step gains four digits in a hundred.
const MOST_STEPS: usize = 100;

/// The next step must be this much smaller for another one to be worth its while.
const CONTRACTION: f64 = 0.9;

/// How many roundings of the cost a step may raise it by.
const ROUNDINGS: f64 = 10.0;

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
    /// Polishes `point`, a minimum by the test `by`; by step if the polish reached its end.
    pub(super) fn polish<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        mut point: Point<M>,
        mut by: Convergence,
    ) -> Result<(Point<M>, Convergence), FitError> {
        let mut proposal = self.undamped(&point)?;
        let mut effect = point.model.image_norm(&proposal.step);
        for _ in 0..MOST_STEPS {
            let parameter_length = felt_length(&point, &point.parameters);
            let length = felt_length(&point, &proposal.step);
            if length <= self.options.step_tolerance * parameter_length {
                by = Convergence::Step;
            }
            if length <= 0.25 * f64::EPSILON * parameter_length {
                break;
            }
            let Ok(evaluation) = self.evaluate(problem, &proposal.parameters)? else {
                break;
            };
            let allowed = ROUNDINGS * Self::cost_rounding(&point);
            if evaluation.cost > point.evaluation.cost + allowed {
                break;
            }
            let next = self.arrive(problem, proposal.parameters, evaluation)?;
            let next_proposal = self.undamped(&next)?;
            let next_effect = next.model.image_norm(&next_proposal.step);
            if next_effect.is_nan() || next_effect > CONTRACTION * effect {
                break;
            }
            (point, proposal, effect) = (next, next_proposal, next_effect);
        }
        Ok((point, by))
    }
}
