//! What chooses a step: asked for one, told what became of it.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::dogleg::Dogleg;
use super::gauss_newton::GaussNewton;
use super::gauss_newton_first::GaussNewtonFirst;
use super::levenberg_marquardt::{MoreDamping, NielsenDamping};
use crate::linear::LinearModel;
use crate::options::{Damping, Method, Options};

/// What became of a step whose cost could be computed.
#[derive(Debug, Clone, Copy)]
pub struct Trial {
    /// Fall of the cost; negative when it rose.
    pub actual: f64,
    /// Fall that the linear model promised, positive.
    pub predicted: f64,
    /// ‖D s‖.
    pub length: f64,
    /// gᵀ s, negative along a direction of descent.
    pub slope: f64,
}

impl Trial {
    /// Actual over predicted fall.
    pub fn gain(&self) -> f64 {
        if self.predicted > 0.0 {
            self.actual / self.predicted
        } else {
            f64::NEG_INFINITY
        }
    }
}

/// A way to choose steps.
pub trait Strategy {
    /// Its name, for observers and tables.
    fn name(&self) -> &'static str;

    /// Called before the first step, and to start afresh, with ‖D p‖.
    fn begin(&mut self, parameter_length: f64);

    /// The undamped step from the point promises next to nothing.
    fn near_end(&mut self) {}

    /// The step to try, for the positive diagonal `scale` of D.
    fn step<M: LinearModel>(&mut self, model: &M, scale: &DVector<f64>) -> DVector<f64>;

    /// The damping λ of the last step, zero for an undamped one.
    fn damping(&self) -> f64;

    /// Whether shorter steps would not help either.
    fn gives_up(&self) -> bool {
        false
    }

    /// The last step was taken.
    fn accepted(&mut self, trial: &Trial);

    /// The last step raised the cost, or lowered it too little.
    fn rejected(&mut self, trial: &Trial);

    /// The model has no value after the last step, of length ‖D s‖.
    fn invalid(&mut self, length: f64);
}

/// The strategy of a [`Method`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Steps {
    /// Gauss-Newton with line search.
    GaussNewton(GaussNewton),
    /// Gauss-Newton, damped where a step fails.
    GaussNewtonFirst(GaussNewtonFirst),
    /// Levenberg-Marquardt with a trust radius.
    More(MoreDamping),
    /// Levenberg-Marquardt with Nielsen's damping.
    Nielsen(NielsenDamping),
    /// Dogleg.
    Dogleg(Dogleg),
}

impl Steps {
    /// The strategy that the options ask for.
    pub fn of(options: &Options) -> Self {
        match options.method {
            Method::GaussNewton => Self::GaussNewton(GaussNewton::default()),
            Method::GaussNewtonFirst => {
                Self::GaussNewtonFirst(GaussNewtonFirst::new(options.initial_damping))
            }
            Method::LevenbergMarquardt(Damping::More) => {
                Self::More(MoreDamping::new(options.initial_radius))
            }
            Method::LevenbergMarquardt(Damping::Nielsen) => {
                Self::Nielsen(NielsenDamping::new(options.initial_damping))
            }
            Method::Dogleg => Self::Dogleg(Dogleg::new(options.initial_radius)),
        }
    }
}

macro_rules! delegate {
    ($self:ident, $strategy:ident => $call:expr) => {
        match $self {
            Steps::GaussNewton($strategy) => $call,
            Steps::GaussNewtonFirst($strategy) => $call,
            Steps::More($strategy) => $call,
            Steps::Nielsen($strategy) => $call,
            Steps::Dogleg($strategy) => $call,
        }
    };
}

impl Strategy for Steps {
    fn name(&self) -> &'static str {
        delegate!(self, s => s.name())
    }

    fn begin(&mut self, parameter_length: f64) {
        delegate!(self, s => s.begin(parameter_length));
    }

    fn near_end(&mut self) {
        delegate!(self, s => s.near_end());
    }

    fn step<M: LinearModel>(&mut self, model: &M, scale: &DVector<f64>) -> DVector<f64> {
        delegate!(self, s => s.step(model, scale))
    }

    fn damping(&self) -> f64 {
        delegate!(self, s => s.damping())
    }

    fn gives_up(&self) -> bool {
        delegate!(self, s => s.gives_up())
    }

    fn accepted(&mut self, trial: &Trial) {
        delegate!(self, s => s.accepted(trial));
    }

    fn rejected(&mut self, trial: &Trial) {
        delegate!(self, s => s.rejected(trial));
    }

    fn invalid(&mut self, length: f64) {
        delegate!(self, s => s.invalid(length));
    }
}

/// The fraction of a failed step at which the parabola through the cost, its slope and the failed
/// value is lowest, kept between a tenth and a half.
pub(crate) fn backtrack(trial: &Trial) -> f64 {
    let rise = -trial.actual;
    let fraction = -trial.slope / (2.0 * (rise - trial.slope));
    if fraction.is_finite() {
        fraction.clamp(0.1, 0.5)
    } else {
        0.1
    }
}

/// The next trust radius after a trial (Moré 1978, section 4, as MINPACK has it): shrunk to where
/// a parabola has its lowest point after a poor step, twice the step after a good one.
pub(crate) fn next_radius(radius: f64, undamped: bool, trial: &Trial) -> f64 {
    let gain = trial.gain();
    if gain <= 0.25 {
        let factor = if trial.actual >= 0.0 {
            0.5
        } else {
            backtrack(trial)
        };
        factor * radius.min(10.0 * trial.length)
    } else if undamped || gain >= 0.75 {
        2.0 * trial.length
    } else {
        radius
    }
}
