//! What is said at a minimum: which combinations of parameters it does not determine.

use argmin::core::Problem as Counted;
use nalgebra::DVector;

use super::minimiser::{Minimiser, Point, broken_off};
use super::restrict::{self, free_parameters};
use super::strategy::Strategy;
use super::system::System;
use crate::linear::LinearModel;
use crate::outcome::{Combination, Convergence, Ending, FitError};

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
        let (null, norms) = if free.len() == n {
            (point.model.null_space(), point.model.column_norms().clone())
        } else {
            let reduced = restrict::restricted(&point.model, &free, &DVector::zeros(n))?;
            (reduced.null_space(), reduced.column_norms().clone())
        };
        if null.ncols() == 0 {
            return Ok(Ending::Converged(by));
        }
        let combinations = null
            .column_iter()
            .map(|column| Combination::from_direction(&column.into_owned(), &norms, &names))
            .collect();
        Ok(Ending::NotIdentifiable { by, combinations })
    }
}
