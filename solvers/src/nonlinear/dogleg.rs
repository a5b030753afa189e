//! Powell's dogleg: along steepest descent to its lowest point, then towards the undamped step.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::strategy::{Strategy, Trial, next_radius};
use crate::linear::LinearModel;

/// The dogleg step within a trust radius (Powell 1970; Nocedal & Wright 2006, 4.1), in
/// parameters scaled by D.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Dogleg {
    initial_radius: f64,
    radius: f64,
    undamped: bool,
    first: bool,
}

impl Dogleg {
    /// Starts with a radius of `initial_radius` times ‖D p‖.
    pub fn new(initial_radius: f64) -> Self {
        Self {
            initial_radius,
            radius: initial_radius,
            undamped: false,
            first: true,
        }
    }
}

impl Strategy for Dogleg {
    fn name(&self) -> &'static str {
        "dogleg"
    }

    fn begin(&mut self, parameter_length: f64) {
        *self = Self::new(self.initial_radius);
        if parameter_length > 0.0 {
            self.radius *= parameter_length;
        }
    }

    fn step<M: LinearModel>(&mut self, model: &M, scale: &DVector<f64>) -> DVector<f64> {
        let full = model.undamped_step();
        let length = full.component_mul(scale).norm();
        self.undamped = length <= self.radius;
        if self.first && length.is_finite() {
            self.radius = self.radius.min(length);
            self.first = false;
        }
        if self.undamped {
            return full;
        }
        // Steepest descent in scaled parameters, to the lowest point of the model.
        let downhill = model.steepest_descent(scale);
        let slope = downhill.component_mul(scale).norm();
        let bend = model.image_norm(&downhill);
        if bend == 0.0 || slope == 0.0 {
            return full * (self.radius / length);
        }
        let lowest = &downhill * (slope / bend).powi(2);
        let lowest_length = lowest.component_mul(scale).norm();
        if lowest_length >= self.radius || !length.is_finite() {
            return lowest * (self.radius / lowest_length).min(1.0);
        }
        let leg = full - &lowest;
        let fraction = to_radius(
            &lowest.component_mul(scale),
            &leg.component_mul(scale),
            self.radius,
        );
        lowest + leg * fraction
    }

    fn damping(&self) -> f64 {
        0.0
    }

    fn accepted(&mut self, trial: &Trial) {
        self.radius = next_radius(self.radius, self.undamped, trial);
    }

    fn rejected(&mut self, trial: &Trial) {
        self.radius = next_radius(self.radius, self.undamped, trial);
    }

    fn invalid(&mut self, length: f64) {
        self.radius = 0.25 * self.radius.min(length);
    }
}

/// The τ in 0..1 with ‖a + τ b‖ = radius, for ‖a‖ < radius ≤ ‖a + b‖, without cancellation.
fn to_radius(a: &DVector<f64>, b: &DVector<f64>, radius: f64) -> f64 {
    let (square, middle) = (b.norm_squared(), a.dot(b));
    let room = (radius * radius - a.norm_squared()).max(0.0);
    let root = (middle * middle + square * room).sqrt();
    let fraction = if middle > 0.0 {
        room / (middle + root)
    } else {
        (root - middle) / square
    };
    fraction.clamp(0.0, 1.0)
}
