//! What is done, and said, when every step along a method's path has failed.
//!
//! Four things lead there: the cost is flat to its rounding although the undamped step promises
//! more; columns of the Jacobian so badly scaled that no trust region suits them all; a Jacobian
//! that does not belong to the residuals; a wall, beyond which the model has no value. The parameter with the steepest cost is moved alone to
//! tell them apart.

use argmin::core::Problem as Counted;
use nalgebra::DVector;

use super::minimiser::{Minimiser, Point};
use super::restrict::free_parameters;
use super::strategy::Strategy;
use super::system::{Evaluation, System};
use crate::linear::LinearModel;
use crate::outcome::FitError;

/// What moving one parameter showed.
pub(super) enum Verdict {
    /// It lowered the cost: the fit goes on from there.
    Better(DVector<f64>, Evaluation),
    /// The Jacobian is right and the cost as low as its rounding lets one see.
    Flat,
    /// The cost does not change as the Jacobian says.
    WrongJacobian,
    /// The model has no value where the parameter moves to.
    NoValue(String),
}

/// Fractions of the parameter's own lowest point that are tried.
const FRACTIONS: [f64; 7] = [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Least share of the promised fall that counts as one.
const LEAST_GAIN: f64 = 1e-2;

/// Relative step of the central difference: small beside the curves of the model, large beside
/// its rounding.
const DIFFERENCE: f64 = 1e-6;

/// How far a slope found by differences may lie from gⱼ, as a share of the most it could be,
/// ‖Jⱼ‖ ‖r‖, before the Jacobian is called wrong. Slopes below that are those of a flat cost.
const DISAGREEMENT: f64 = 1e-5;

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
    pub(super) fn rescue<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        point: &Point<M>,
    ) -> Result<Verdict, FitError> {
        let gradient = point.model.gradient();
        let norms = point.model.column_norms();
        let bounds = self.options.bounds.as_ref();
        let steepest = free_parameters(bounds, &point.parameters, gradient)
            .into_iter()
            .filter(|&j| norms[j] > 0.0)
            .max_by(|&i, &j| {
                let cosine = |k: usize| gradient[k].abs() / norms[k];
                cosine(i).total_cmp(&cosine(j))
            });
        let Some(j) = steepest else {
            return Ok(Verdict::Flat);
        };
        let moved = |by: f64| {
            let mut parameters = point.parameters.clone();
            parameters[j] += by;
            if let Some(limit) = bounds.and_then(|b| b.beyond(j, parameters[j])) {
                parameters[j] = limit;
            }
            parameters
        };

        let rounding = Self::cost_rounding(point);
        let lowest = -gradient[j] / (norms[j] * norms[j]);
        for fraction in FRACTIONS {
            let promised = -gradient[j] * lowest * fraction * (1.0 - 0.5 * fraction);
            if promised <= rounding {
                break;
            }
            let parameters = moved(lowest * fraction);
            if let Ok(evaluation) = self.evaluate(problem, &parameters)? {
                let fall = point.evaluation.cost - evaluation.cost;
                if fall >= LEAST_GAIN * promised {
                    return Ok(Verdict::Better(parameters, evaluation));
                }
            }
        }

        let residual = (2.0 * point.evaluation.cost).sqrt();
        let h = DIFFERENCE * point.parameters[j].abs().max(residual / norms[j]);
        let (ahead, behind) = (
            self.evaluate(problem, &moved(h))?,
            self.evaluate(problem, &moved(-h))?,
        );
        let (ahead, behind) = match (ahead, behind) {
            (Ok(ahead), Ok(behind)) => (ahead, behind),
            (Err(reason), _) | (_, Err(reason)) => return Ok(Verdict::NoValue(reason)),
        };
        let slope = 0.5 * (ahead.cost - behind.cost) / h;
        if (slope - gradient[j]).abs() <= DISAGREEMENT * norms[j] * residual {
            Ok(Verdict::Flat)
        } else {
            Ok(Verdict::WrongJacobian)
        }
    }
}
