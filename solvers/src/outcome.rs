//! How a fit ends, in words, and what it hands back.

use std::fmt;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::bounds::ActiveBound;
use crate::covariance::Covariance;
use crate::linear::pivoted_qr::norm;
use crate::linear::triangle::Triangle;
use crate::loss::Loss;

/// Which test found the minimum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Convergence {
    /// The cost can fall no further than by a negligible share.
    Cost,
    /// The next step is negligible beside the parameters.
    Step,
    /// The residuals are orthogonal to every column of the Jacobian.
    Gradient,
}

/// Why a fit ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Ending {
    /// A minimum was found and every parameter is determined by it.
    Converged(Convergence),
    /// A minimum was found, but some combinations of parameters leave every residual unchanged.
    NotIdentifiable {
        /// The test that found the minimum.
        by: Convergence,
        /// The combinations that the data do not determine.
        combinations: Vec<Combination>,
    },
    /// The allowed number of iterations was used up before a minimum was found.
    IterationLimit,
    /// The allowed time was used up before a minimum was found.
    TimeLimit,
    /// No step along the direction of descent lowers the cost: the Jacobian does not belong to
    /// the residuals, or the residuals are not smooth.
    NoDescent,
    /// Every step that would lower the cost leads to where the model has no value: no minimum.
    AtWall {
        /// Why there is no value, in the model's own words.
        reason: String,
    },
    /// The cost falls on and on while a parameter grows: there is no minimum at finite parameters.
    RunsAway {
        /// The name of the parameter.
        parameter: String,
    },
    /// The squares of the residuals are too large or too small for floating-point numbers.
    OutOfRange,
    /// The caller raised the stop flag or interrupted the run.
    StoppedByUser,
}

/// A combination of parameters that can be moved together without changing any residual.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Combination {
    /// Each parameter that takes part and how far it moves relative to the others, in the
    /// parameters' own units.
    pub terms: Vec<(String, f64)>,
}

impl Ending {
    /// Whether a minimum was found at which every parameter is determined.
    pub fn is_converged(&self) -> bool {
        matches!(self, Self::Converged(_))
    }

    /// Whether a minimum was found, determined or not.
    pub fn is_minimum(&self) -> bool {
        matches!(self, Self::Converged(_) | Self::NotIdentifiable { .. })
    }
}

impl Combination {
    /// Keeps the entries of a null-space direction that matter, beside the largest in units of
    /// the Jacobian's column norms.
    pub(crate) fn from_direction(
        direction: &DVector<f64>,
        norms: &DVector<f64>,
        names: &[String],
    ) -> Self {
        const NEGLIGIBLE: f64 = 1e-6;
        let weight = |j: usize| {
            let unit = if norms[j] > 0.0 { norms[j] } else { 1.0 };
            (direction[j] * unit).abs()
        };
        let largest = (0..direction.len()).map(weight).fold(0.0, f64::max);
        let terms = (0..direction.len())
            .filter(|&j| weight(j) > NEGLIGIBLE * largest)
            .map(|j| (names[j].clone(), direction[j]))
            .collect();
        Self { terms }
    }
}

impl fmt::Display for Convergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cost => "the cost can fall no further",
            Self::Step => "the next step is negligible",
            Self::Gradient => "the gradient is zero to rounding",
        })
    }
}

impl fmt::Display for Combination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.terms.as_slice() {
            [] => f.write_str("no parameter"),
            [(name, _)] => write!(f, "`{name}` has no effect on the residuals"),
            [(first, unit), rest @ ..] => {
                write!(f, "`{first}` by +1")?;
                for (name, amount) in rest {
                    write!(f, ", `{name}` by {:+.4}", amount / unit)?;
                }
                f.write_str(" together change no residual")
            }
        }
    }
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Converged(by) => write!(f, "converged: {by}"),
            Self::NotIdentifiable { by, combinations } => {
                write!(f, "not identifiable: ")?;
                for (i, combination) in combinations.iter().enumerate() {
                    let separator = if i > 0 { "; " } else { "" };
                    write!(f, "{separator}{combination}")?;
                }
                write!(f, " (a minimum was reached: {by})")
            }
            Self::IterationLimit => f.write_str("iteration limit reached before a minimum"),
            Self::TimeLimit => f.write_str("time limit reached before a minimum"),
            Self::NoDescent => f.write_str(
                "no descent: no step lowers the cost, check the Jacobian against the residuals",
            ),
            Self::AtWall { reason } => write!(
                f,
                "at a wall: every step that lowers the cost leads to where the model has no value \
                 ({reason}); this is no minimum"
            ),
            Self::RunsAway { parameter } => write!(
                f,
                "no minimum: the cost falls on and on while `{parameter}` grows"
            ),
            Self::OutOfRange => f.write_str(
                "out of range: the squares of the residuals overflow or vanish, \
                 give the residuals in another unit",
            ),
            Self::StoppedByUser => f.write_str("stopped by the user before a minimum"),
        }
    }
}

/// What became of a step that was tried.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// Cost at the best point after it.
    pub cost: f64,
    /// By how much the linear model promised to lower the cost.
    pub predicted: f64,
    /// Damping λ of the step; zero for an undamped one.
    pub damping: f64,
    /// Whether it was taken.
    pub accepted: bool,
}

/// Why a fit could not be made at all.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// A setting is outside its range.
    #[error("setting `{setting}` is {value}: it must be {must}")]
    Setting {
        /// Name of the field of [`Options`](crate::Options).
        setting: &'static str,
        /// The value it was given.
        value: String,
        /// What it must be.
        must: &'static str,
    },
    /// The problem has no parameters.
    #[error("the problem has no parameters: there is nothing to fit")]
    NoParameters,
    /// The problem has fewer residuals than parameters.
    #[error(
        "{residuals} residuals cannot determine {parameters} parameters: add readings or fix parameters"
    )]
    FewerResidualsThanParameters {
        /// Number of residuals.
        residuals: usize,
        /// Number of parameters.
        parameters: usize,
    },
    /// The start has the wrong length.
    #[error("the start has {found} values, the problem {expected} parameters")]
    StartLength {
        /// Number of parameters.
        expected: usize,
        /// Length of the start.
        found: usize,
    },
    /// A start value is not a number or infinite.
    #[error("the start of parameter `{parameter}` is {value}: give a finite value")]
    StartNotFinite {
        /// Name of the parameter.
        parameter: String,
        /// Its start.
        value: f64,
    },
    /// Bounds of the wrong length.
    #[error("the bounds are for {found} parameters, the problem has {expected}")]
    BoundsLength {
        /// Number of parameters.
        expected: usize,
        /// Length of the bounds.
        found: usize,
    },
    /// A lower bound above its upper one, or not a number.
    #[error(
        "the bounds of parameter `{parameter}` are {lower} and {upper}: the lower must not exceed the upper"
    )]
    BoundsCrossed {
        /// Name of the parameter.
        parameter: String,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A start outside the bounds.
    #[error(
        "the start of parameter `{parameter}` is {value}, outside its bounds {lower} to {upper}"
    )]
    StartOutsideBounds {
        /// Name of the parameter.
        parameter: String,
        /// Its start.
        value: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// The model has no value at the start.
    #[error("at the start {reason}: choose another start")]
    NoValueAtStart {
        /// The model's own words.
        reason: String,
    },
    /// The model has residuals but no Jacobian at some parameters.
    #[error("the Jacobian has no value where the residuals have one: {reason}")]
    NoJacobian {
        /// The model's own words.
        reason: String,
    },
    /// The Jacobian has the wrong shape.
    #[error("the Jacobian is {found_rows} by {found_columns}, it must be {rows} by {columns}")]
    JacobianShape {
        /// Number of residuals.
        rows: usize,
        /// Number of parameters.
        columns: usize,
        /// Rows found.
        found_rows: usize,
        /// Columns found.
        found_columns: usize,
    },
    /// An entry of the Jacobian is not a number or infinite.
    #[error("the derivative of residual {residual} by parameter `{parameter}` is not finite")]
    JacobianNotFinite {
        /// Name of the parameter.
        parameter: String,
        /// Index of the residual.
        residual: usize,
    },
    /// A checkpoint that belongs to another problem.
    #[error(
        "the checkpoint is of a problem with {found} parameters, this one has {expected}: \
         remove it to start afresh"
    )]
    CheckpointLength {
        /// Number of parameters.
        expected: usize,
        /// Number of parameters in the checkpoint.
        found: usize,
    },
    /// An observer or a checkpoint failed.
    #[error("the run was broken off: {reason}")]
    BrokenOff {
        /// What failed.
        reason: String,
    },
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The parameters, length n.
    pub parameters: DVector<f64>,
    /// The residuals at the parameters, without the loss, length m.
    pub residuals: DVector<f64>,
    /// The Jacobian at the parameters, without the loss, m × n.
    pub jacobian: DMatrix<f64>,
    /// ½ Σ ρ(rᵢ²): half the sum of squares for ordinary least squares. Infinite or zero where that
    /// is beyond the range of numbers.
    pub cost: f64,
    /// Why the fit ended.
    pub ending: Ending,
    /// Iterations made.
    pub iterations: u64,
    /// How often residuals were computed.
    pub residual_evaluations: u64,
    /// How often the Jacobian was computed.
    pub jacobian_evaluations: u64,
    /// What became of each step that was tried.
    pub history: Vec<Iteration>,
    /// ‖D s‖ / ‖D p‖ of the undamped step s that would come next, D the column norms of the
    /// Jacobian: how far the parameters still are from rest.
    pub next_step: f64,
    /// The parameters' names, length n.
    pub names: Vec<String>,
    /// The bounds that hold a parameter.
    pub active_bounds: Vec<ActiveBound>,
    /// The loss that was minimised.
    pub loss: Loss,
    /// The triangle of the Jacobian in the parameters not held by a bound, of residuals in `unit`.
    pub(crate) triangle: Triangle,
    /// The power of two in which residuals were counted while fitting.
    pub(crate) unit: f64,
}

impl Fit {
    /// Number of residuals less the number of determined, unheld parameters.
    pub fn degrees_of_freedom(&self) -> usize {
        self.residuals.len().saturating_sub(self.triangle.rank())
    }

    /// √(Σ r² / ν): the residual standard deviation, `None` without degrees of freedom.
    pub fn residual_deviation(&self) -> Option<f64> {
        let freedom = self.degrees_of_freedom();
        (freedom > 0).then(|| norm(self.residuals.as_slice()) / (freedom as f64).sqrt())
    }

    /// The covariance of the parameters for residuals in units of their standard deviation; for
    /// others see [`Covariance::scaled_by_residuals`].
    pub fn covariance(&self) -> Covariance {
        Covariance::of(self)
    }
}
