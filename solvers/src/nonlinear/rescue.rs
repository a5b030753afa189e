//! What is done, and said, when every step along a method's path has failed.
//!
//! Four things lead there: the cost is flat to its rounding although the undamped step promises
//! more; columns of the Jacobian so badly scaled that no trust region suits them all; a Jacobian
//! that does not belong to the residuals; a wall, beyond which the model has no value. To tell them
//! apart, parameters are moved along a simple direction of descent: that of the parameter with the
//! steepest cost alone, under constraints the steepest that keeps them.

use argmin::core::Problem as Counted;
use nalgebra::DVector;

use super::minimiser::{Minimiser, Point};
use super::restrict::free_parameters;
use super::strategy::Strategy;
use super::system::{Evaluation, System};
use crate::linear::LinearModel;
use crate::outcome::FitError;

/// What moving along the direction showed.
pub(super) enum Verdict<M> {
    /// It lowered the cost: the fit goes on from there.
    Better(DVector<f64>, Evaluation<M>),
    /// The Jacobian is right and the cost as low as its rounding lets one see.
    Flat,
    /// The cost does not change as the Jacobian says.
    WrongJacobian,
    /// The model has no value where it leads.
    NoValue(String),
}

/// Fractions of the way to the lowest point along the direction that are tried.
const FRACTIONS: [f64; 7] = [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Least share of the promised fall that counts as one.
const LEAST_GAIN: f64 = 1e-2;

/// Relative step of the central difference: small beside the curves of the model, large beside
/// its rounding.
const DIFFERENCE: f64 = 1e-6;

/// How far a slope found by differences may lie from gᵀd, as a share of the most it could be,
/// ‖J d‖ ‖r‖, before the Jacobian is called wrong. Slopes below that are those of a flat cost.
const DISAGREEMENT: f64 = 1e-5;

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
    pub(super) fn rescue<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        point: &Point<M>,
    ) -> Result<Verdict<M>, FitError> {
        let gradient = point.model.gradient();
        let bounds = self.options.bounds.as_ref();
        let free = free_parameters(bounds, &point.parameters, gradient);
        let Some(direction) = point.model.probe(&free) else {
            return Ok(Verdict::Flat);
        };
        let (expected, image) = (gradient.dot(&direction), point.model.image_norm(&direction));
        let moved = |by: f64| {
            let mut parameters = &point.parameters + &direction * by;
            for j in 0..parameters.len() {
                if let Some(limit) = bounds.and_then(|b| b.beyond(j, parameters[j])) {
                    parameters[j] = limit;
                }
            }
            parameters
        };

        let rounding = Self::cost_rounding(point);
        let lowest = -expected / (image * image);
        for fraction in FRACTIONS {
            let promised = -expected * lowest * fraction * (1.0 - 0.5 * fraction);
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
        let along = point.parameters.dot(&direction).abs() / direction.norm_squared();
        let h = DIFFERENCE * along.max(residual / image);
        let (ahead, behind) = (
            self.evaluate(problem, &moved(h))?,
            self.evaluate(problem, &moved(-h))?,
        );
        let (ahead, behind) = match (ahead, behind) {
            (Ok(ahead), Ok(behind)) => (ahead, behind),
            (Err(reason), _) | (_, Err(reason)) => return Ok(Verdict::NoValue(reason)),
        };
        let slope = 0.5 * (ahead.cost - behind.cost) / h;
        if (slope - expected).abs() <= DISAGREEMENT * image * residual {
            Ok(Verdict::Flat)
        } else {
            Ok(Verdict::WrongJacobian)
        }
    }
}
