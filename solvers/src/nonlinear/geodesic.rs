//! Geodesic acceleration: the second-order correction of a damped step.
//!
//! Transtrum & Sethna, "Improvements to the Levenberg-Marquardt algorithm for nonlinear
//! least-squares minimization", arXiv:1201.5885 (2012).

use argmin::core::Problem as Counted;
use nalgebra::DVector;

use super::minimiser::{Minimiser, Point, broken_off};
use super::strategy::Strategy;
use super::system::System;
use crate::linear::LinearModel;
use crate::outcome::FitError;

/// Longest acceleration 2‖D a‖ / ‖D v‖ that a step v accepts (eq. 15).
const MOST_ACCELERATION: f64 = 0.75;

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
    /// ½ a with a = −(JᵀJ + λD²)⁻¹ Jᵀ r″, unless ‖D a‖ > ¾/2 ‖D v‖ (Transtrum & Sethna 2012,
    /// eqs. 12 and 15).
    pub(super) fn acceleration<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        point: &Point<M>,
        velocity: &DVector<f64>,
    ) -> Result<Option<DVector<f64>>, FitError> {
        let second = problem
            .problem("residual_count", |system| {
                Ok(system.second_along(
                    &point.parameters,
                    &point.evaluation,
                    &point.model,
                    velocity,
                    self.unit,
                ))
            })
            .map_err(broken_off)?;
        let damping = self.strategy.damping();
        let correction = second
            .and_then(|second| point.model.step_for(&second, damping, &self.scale))
            .map(|acceleration| acceleration * 0.5);
        Ok(correction.filter(|half| {
            4.0 * self.scaled_length(half) <= MOST_ACCELERATION * self.scaled_length(velocity)
        }))
    }
}
