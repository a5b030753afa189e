//! Gauss-Newton, damped only from where a step fails.
//!
//! Levenberg (1944) and Marquardt (1963) with Nielsen's schedule
//! ([`NielsenDamping`](super::levenberg_marquardt::NielsenDamping)), begun without damping: a model
//! whose many parameters enter linearly needs none near its solution.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::levenberg_marquardt::{GROWTH, nielsen_factor};
use super::strategy::{Strategy, Trial};
use crate::linear::LinearModel;

/// Damping below this is none.
const NO_DAMPING: f64 = 1e-9;

/// Damping above this means that no step helps.
const TOO_MUCH_DAMPING: f64 = 1e12;

/// Least factor by which the damping falls after a good step: it is to vanish, where Nielsen's own
/// is to stay.
const LEAST_FACTOR: f64 = 0.1;

/// What became of undamped steps near the end: where residuals are large they may lead away from a
/// minimum that damped steps approach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum UndampedEnd {
    NotTried,
    Tried,
    LedAway,
}

/// Undamped steps; after a failure damped ones, until the damping has fallen to nothing.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct GaussNewtonFirst {
    first_damping: f64,
    damping: f64,
    growth: f64,
    end: UndampedEnd,
    last_taken: bool,
}

impl GaussNewtonFirst {
    /// Damps with λ = `first_damping` after the first failure.
    pub fn new(first_damping: f64) -> Self {
        Self {
            first_damping,
            damping: 0.0,
            growth: GROWTH,
            end: UndampedEnd::NotTried,
            last_taken: false,
        }
    }

    fn raise(&mut self) {
        if self.damping == 0.0 && self.end == UndampedEnd::Tried {
            self.end = UndampedEnd::LedAway;
        }
        self.damping = if self.damping == 0.0 {
            self.first_damping
        } else {
            self.damping * self.growth
        };
        self.growth *= GROWTH;
        self.last_taken = false;
    }
}

impl Strategy for GaussNewtonFirst {
    fn name(&self) -> &'static str {
        "Gauss-Newton, damped where a step fails"
    }

    fn begin(&mut self, _parameter_length: f64) {
        *self = Self::new(self.first_damping);
    }

    /// From a point that a damped step has reached near the end, the undamped step shows whether it
    /// is the end.
    fn near_end(&mut self) {
        if self.damping > 0.0 && self.last_taken && self.end != UndampedEnd::LedAway {
            self.damping = 0.0;
            self.end = UndampedEnd::Tried;
        }
    }

    fn step<M: LinearModel>(&mut self, model: &M, scale: &DVector<f64>) -> DVector<f64> {
        if self.damping == 0.0 {
            model.undamped_step()
        } else {
            model.damped_step(self.damping, scale).step
        }
    }

    fn damping(&self) -> f64 {
        self.damping
    }

    fn gives_up(&self) -> bool {
        self.damping > TOO_MUCH_DAMPING
    }

    fn accepted(&mut self, trial: &Trial) {
        self.damping *= nielsen_factor(trial.gain(), LEAST_FACTOR);
        self.growth = GROWTH;
        self.last_taken = true;
        if self.damping < NO_DAMPING {
            self.damping = 0.0;
        }
    }

    fn rejected(&mut self, _trial: &Trial) {
        self.raise();
    }

    fn invalid(&mut self, _length: f64) {
        self.raise();
    }
}
