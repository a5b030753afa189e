//! What the minimiser asks of a least-squares system, dense or structured.

use nalgebra::{DMatrix, DVector};

use crate::linear::LinearModel;
use crate::linear::dense::{DenseModel, Factorization};
use crate::loss::Loss;
use crate::outcome::FitError;
use crate::problem::{NoValue, Problem};

/// The cost at some parameters, with the residuals where the system keeps them, both for residuals
/// counted in the unit that was asked for.
#[derive(Debug, Clone)]
pub struct Evaluation<M> {
    /// ½ Σ ρ(rᵢ²).
    pub cost: f64,
    /// The residuals without the loss; empty for a system that forgets them.
    pub residuals: DVector<f64>,
    /// The linear model, where it comes with the cost: a system that makes its rows, uses and
    /// forgets them needs one pass for both.
    pub model: Option<M>,
    /// Whether squares of residuals have left the range of numbers and no unit helps.
    pub out_of_range: bool,
}

/// A least-squares system that can be evaluated and linearised.
///
/// Residuals and their derivatives are divided by `unit`, a power of two that the minimiser chooses
/// so that squares neither overflow nor vanish; it is 1 for residuals of ordinary size.
pub trait System {
    /// The factored linear model it makes.
    type Model: LinearModel;

    /// Number of parameters, n.
    fn parameter_count(&self) -> usize;

    /// The name of a parameter.
    fn parameter_name(&self, index: usize) -> String;

    /// Whether residuals can be counted in another unit than 1.
    fn has_units(&self) -> bool {
        true
    }

    /// Cost and residuals at some parameters. The residuals are finite; the cost is not where their
    /// squares overflow.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined or not finite.
    fn evaluate(
        &self,
        parameters: &DVector<f64>,
        unit: f64,
    ) -> Result<Evaluation<Self::Model>, NoValue>;

    /// The linear model at parameters whose evaluation is given; one that came with the evaluation
    /// is taken out of it.
    ///
    /// # Errors
    /// [`FitError`] where the Jacobian is not defined, not finite or of the wrong shape.
    fn linearize(
        &self,
        parameters: &DVector<f64>,
        evaluation: &mut Evaluation<Self::Model>,
        unit: f64,
    ) -> Result<Self::Model, FitError>;

    /// The second derivative of the residuals along v, d²r(p + t v)/dt² at t = 0, in the rows of
    /// the linear model; `None` where the system does not offer it.
    fn second_along(
        &self,
        _parameters: &DVector<f64>,
        _evaluation: &Evaluation<Self::Model>,
        _model: &Self::Model,
        _direction: &DVector<f64>,
        _unit: f64,
    ) -> Option<DVector<f64>> {
        None
    }
}

/// A [`Problem`] with its loss, factored densely.
#[derive(Debug)]
pub struct Dense<'a, P: ?Sized> {
    problem: &'a P,
    loss: Loss,
    factorization: Factorization,
    rank_tolerance: f64,
}

/// The share of the step over which the second derivative is differenced (Transtrum & Sethna 2012).
const SECOND_DIFFERENCE: f64 = 0.1;

impl<'a, P: Problem + ?Sized> Dense<'a, P> {
    /// The system of a problem.
    pub fn new(
        problem: &'a P,
        loss: Loss,
        factorization: Factorization,
        rank_tolerance: f64,
    ) -> Self {
        Self {
            problem,
            loss,
            factorization,
            rank_tolerance,
        }
    }

    /// The Jacobian without the loss, checked for shape and finite entries.
    pub(crate) fn jacobian(&self, parameters: &DVector<f64>) -> Result<DMatrix<f64>, FitError> {
        self.jacobian_in(1.0, parameters)
    }

    /// The Jacobian of the residuals counted in `unit`.
    fn jacobian_in(&self, unit: f64, parameters: &DVector<f64>) -> Result<DMatrix<f64>, FitError> {
        let (rows, columns) = (
            self.problem.residual_count(),
            self.problem.parameter_count(),
        );
        let jacobian = self
            .problem
            .jacobian(parameters)
            .map_err(|no| FitError::NoJacobian { reason: no.reason })?;
        let (found_rows, found_columns) = jacobian.shape();
        if (found_rows, found_columns) != (rows, columns) {
            return Err(FitError::JacobianShape {
                rows,
                columns,
                found_rows,
                found_columns,
            });
        }
        let jacobian = jacobian / unit;
        match jacobian.iter().position(|value| !value.is_finite()) {
            Some(at) => Err(FitError::JacobianNotFinite {
                parameter: self.problem.parameter_name(at / rows),
                residual: at % rows,
            }),
            None => Ok(jacobian),
        }
    }

    fn residuals(&self, parameters: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let residuals = self.problem.residuals(parameters)?;
        let expected = self.problem.residual_count();
        if residuals.len() != expected {
            return Err(NoValue::new(format!(
                "the problem gives {} residuals where it announced {expected}",
                residuals.len()
            )));
        }
        match residuals.iter().position(|value| !value.is_finite()) {
            Some(at) => Err(NoValue::new(format!("residual {at} is {}", residuals[at]))),
            None => Ok(residuals),
        }
    }
}

impl<P: Problem + ?Sized> System for Dense<'_, P> {
    type Model = DenseModel;

    fn parameter_count(&self) -> usize {
        self.problem.parameter_count()
    }

    fn parameter_name(&self, index: usize) -> String {
        self.problem.parameter_name(index)
    }

    fn evaluate(
        &self,
        parameters: &DVector<f64>,
        unit: f64,
    ) -> Result<Evaluation<DenseModel>, NoValue> {
        let residuals = self.residuals(parameters)? / unit;
        let cost = self.loss.in_unit(unit).cost(residuals.as_slice());
        // A robust loss may make NaN of squares that overflow.
        let cost = if cost.is_nan() { f64::INFINITY } else { cost };
        Ok(Evaluation {
            // After a start whose squares overflow, what is left may vanish in the unit that it
            // needed.
            out_of_range: unit > 1.0 && cost == 0.0 && residuals.amax() > 0.0,
            cost,
            residuals,
            model: None,
        })
    }

    fn linearize(
        &self,
        parameters: &DVector<f64>,
        evaluation: &mut Evaluation<DenseModel>,
        unit: f64,
    ) -> Result<DenseModel, FitError> {
        let mut jacobian = self.jacobian_in(unit, parameters)?;
        let (factorization, tolerance) = (self.factorization, self.rank_tolerance);
        let loss = self.loss.in_unit(unit);
        if loss.scale().is_none() {
            let residuals = &evaluation.residuals;
            return Ok(DenseModel::new(
                jacobian,
                residuals,
                factorization,
                tolerance,
            ));
        }
        let factors: Vec<(f64, f64)> = evaluation
            .residuals
            .iter()
            .map(|&r| loss.row_factors(r))
            .collect();
        for mut column in jacobian.column_iter_mut() {
            for (entry, (row, _)) in column.iter_mut().zip(&factors) {
                *entry *= row;
            }
        }
        let residuals =
            DVector::from_fn(factors.len(), |i, _| evaluation.residuals[i] * factors[i].1);
        Ok(DenseModel::new(
            jacobian,
            &residuals,
            factorization,
            tolerance,
        ))
    }

    /// 2/h ((r(p + h v) − r(p))/h − J v), eq. 14 of Transtrum & Sethna (2012). Not offered with a
    /// robust loss, whose row factors change along the way.
    fn second_along(
        &self,
        parameters: &DVector<f64>,
        evaluation: &Evaluation<DenseModel>,
        model: &DenseModel,
        direction: &DVector<f64>,
        unit: f64,
    ) -> Option<DVector<f64>> {
        if self.loss.scale().is_some() {
            return None;
        }
        let h = SECOND_DIFFERENCE;
        let ahead = self.residuals(&(parameters + direction * h)).ok()? / unit;
        let slope = model.image(direction)?;
        Some(((ahead - &evaluation.residuals) / h - slope) * (2.0 / h))
    }
}
