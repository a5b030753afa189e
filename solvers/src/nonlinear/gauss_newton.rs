//! Gauss-Newton: the undamped step, shortened until the cost falls.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::strategy::{Strategy, Trial, backtrack};
use crate::linear::LinearModel;

/// Gauss-Newton with a backtracking line search (Nocedal & Wright 2006, 10.3 and 3.5).
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct GaussNewton {
    /// The fraction of the full step to try next.
    fraction: f64,
}

impl Default for GaussNewton {
    fn default() -> Self {
        Self { fraction: 1.0 }
    }
}

impl Strategy for GaussNewton {
    fn name(&self) -> &'static str {
        "Gauss-Newton with line search"
    }

    fn begin(&mut self, _parameter_length: f64) {
        self.fraction = 1.0;
    }

    fn step<M: LinearModel>(&mut self, model: &M, _scale: &DVector<f64>) -> DVector<f64> {
        model.undamped_step() * self.fraction
    }

    fn damping(&self) -> f64 {
        0.0
    }

    fn accepted(&mut self, _trial: &Trial) {
        self.fraction = 1.0;
    }

    fn rejected(&mut self, trial: &Trial) {
        self.fraction *= backtrack(trial);
    }

    fn invalid(&mut self, _length: f64) {
        self.fraction *= 0.25;
    }
}
