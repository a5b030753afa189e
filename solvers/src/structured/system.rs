//! A structured problem as the minimiser asks for it.

use nalgebra::DVector;

use super::evaluate::evaluate;
use super::problem::{Parameters, StructuredProblem};
use crate::linear::bordered::BorderedModel;
use crate::nonlinear::system::{Evaluation, System};
use crate::outcome::FitError;
use crate::problem::NoValue;

/// A [`StructuredProblem`] as a [`System`]: one pass over the rows gives cost and linear model, and
/// the rows are forgotten. Parameters are those of the band, then those of the border.
#[derive(Debug, Clone, Copy)]
pub struct Structured<'a, P> {
    problem: &'a P,
}

impl<'a, P: StructuredProblem> Structured<'a, P> {
    /// The system of a problem.
    pub fn new(problem: &'a P) -> Self {
        Self { problem }
    }

    /// A point in the form of the problem.
    pub(super) fn point(&self, parameters: &DVector<f64>) -> Parameters {
        let (band, border) = parameters.as_slice().split_at(self.problem.band_count());
        Parameters {
            band: band.to_vec(),
            border: border.to_vec(),
        }
    }
}

impl<'a, P: StructuredProblem> System for Structured<'a, P> {
    type Model = BorderedModel<'a>;

    fn parameter_count(&self) -> usize {
        self.problem.band_count() + self.problem.border_count()
    }

    fn parameter_name(&self, index: usize) -> String {
        match index.checked_sub(self.problem.band_count()) {
            None => self.problem.band_name(index),
            Some(j) => self.problem.border_name(j),
        }
    }

    fn has_units(&self) -> bool {
        false
    }

    fn evaluate(
        &self,
        parameters: &DVector<f64>,
        _unit: f64,
    ) -> Result<Evaluation<Self::Model>, NoValue> {
        let at = self.point(parameters);
        let pass = evaluate(self.problem, &at)?;
        let model = BorderedModel::new(
            pass.system,
            self.problem.constraints(),
            self.problem.held(),
            (&at.band, &at.border),
        );
        Ok(Evaluation {
            cost: pass.cost,
            residuals: DVector::zeros(0),
            model: Some(model),
            out_of_range: pass.vanished || !pass.cost.is_finite(),
        })
    }

    fn linearize(
        &self,
        parameters: &DVector<f64>,
        evaluation: &mut Evaluation<Self::Model>,
        unit: f64,
    ) -> Result<Self::Model, FitError> {
        if let Some(model) = evaluation.model.take() {
            return Ok(model);
        }
        self.evaluate(parameters, unit)
            .ok()
            .and_then(|evaluation| evaluation.model)
            .ok_or_else(|| FitError::NoJacobian {
                reason: "there is no value".to_string(),
            })
    }
}
