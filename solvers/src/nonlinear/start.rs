//! Where a run begins, afresh or from a checkpoint.

use argmin::core::Problem as Counted;
use nalgebra::DVector;

use super::minimiser::{Minimiser, Point, broken_off};
use super::strategy::Strategy;
use super::system::System;
use crate::linear::LinearModel;
use crate::outcome::FitError;

/// Below this cost residuals are counted in another unit: squares a hundred decades smaller, as those
/// of single residuals and of steps near the minimum are, still have all their digits.
const LEAST_COST: f64 = 1e-200;

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
    /// The system's number of parameters, and whether it counts residuals in units.
    fn size<O: System<Model = M>>(problem: &mut Counted<O>) -> Result<(usize, bool), FitError> {
        problem
            .problem("name_count", |system| {
                Ok((system.parameter_count(), system.has_units()))
            })
            .map_err(broken_off)
    }

    /// Evaluates the start and chooses the unit in which residuals are counted.
    pub(super) fn start<O: System<Model = M>>(
        &mut self,
        problem: &mut Counted<O>,
        parameters: DVector<f64>,
    ) -> Result<Point<M>, FitError> {
        let (expected, has_units) = Self::size(problem)?;
        let found = parameters.len();
        if found != expected {
            return Err(FitError::StartLength { expected, found });
        }
        let refused = |reason| FitError::NoValueAtStart { reason };
        self.unit = 1.0;
        let plain = self.residuals(problem, &parameters)?.map_err(refused)?;
        let largest = plain.residuals.amax();
        let ordinary = plain.cost.is_finite() && (plain.cost > LEAST_COST || largest == 0.0);
        if ordinary || !has_units {
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
    pub(super) fn resume<O: System<Model = M>>(
        &self,
        problem: &mut Counted<O>,
        parameters: DVector<f64>,
    ) -> Result<Point<M>, FitError> {
        let (expected, _) = Self::size(problem)?;
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
}
