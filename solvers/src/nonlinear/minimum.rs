//! What is said at a minimum: which combinations of parameters it does not determine.

use argmin::core::Problem as Counted;
use nalgebra::DVector;

use super::minimiser::{Minimiser, Point, broken_off};
use super::restrict::{self, free_parameters};
use super::strategy::Strategy;
use super::system::System;
use crate::linear::LinearModel;
use crate::outcome::{Convergence, Ending, FitError};

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
    /// The ending at a minimum: whether the free parameters are determined there.
    pub(super) fn at_minimum<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        point: &Point<M>,
        by: Convergence,
    ) -> Result<Ending, FitError> {
        let n = point.parameters.len();
        let bounds = self.options.bounds.as_ref();
        let free = free_parameters(bounds, &point.parameters, point.model.gradient());
        if free.is_empty() || (free.len() == n && point.model.rank() == n) {
            return Ok(Ending::Converged(by));
        }
        let mut names = Vec::new();
        problem
            .problem("name_count", |system| {
                names = free.iter().map(|&j| system.parameter_name(j)).collect();
                Ok(())
            })
            .map_err(broken_off)?;
        let combinations = if free.len() == n {
            point.model.undetermined(&names)
        } else {
            restrict::restricted(&point.model, &free, &DVector::zeros(n))?.undetermined(&names)
        };
        Ok(if combinations.is_empty() {
            Ending::Converged(by)
        } else {
            Ending::NotIdentifiable { by, combinations }
        })
    }
}
