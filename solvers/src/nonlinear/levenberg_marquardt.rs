//! Levenberg-Marquardt: the damped step, with the damping chosen in one of two ways.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::strategy::{Strategy, Trial, next_radius};
use crate::linear::LinearModel;

/// How far ‖D s‖ may differ from the trust radius, as a share of it.
const RADIUS_SLACK: f64 = 0.1;

/// Refinements of the damping for one radius; two or three are usual.
const MOST_REFINEMENTS: usize = 20;

/// The damping that makes the step as long as a trust radius.
///
/// Moré, "The Levenberg-Marquardt algorithm: implementation and theory", Lecture Notes in
/// Mathematics 630 (1978) 105: sections 4 (radius) and 5 (damping, eqs. 5.5 to 5.8).
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MoreDamping {
    initial_radius: f64,
    radius: f64,
    damping: f64,
    first: bool,
}

impl MoreDamping {
    /// Starts with a radius of `initial_radius` times ‖D p‖.
    pub fn new(initial_radius: f64) -> Self {
        Self {
            initial_radius,
            radius: initial_radius,
            damping: 0.0,
            first: true,
        }
    }

    fn update(&mut self, trial: &Trial) {
        let before = self.radius;
        self.radius = next_radius(self.radius, self.damping == 0.0, trial);
        if trial.gain() <= 0.25 && self.radius > 0.0 {
            self.damping *= before / self.radius;
        } else if self.radius > before {
            self.damping *= 0.5;
        }
    }
}

impl Strategy for MoreDamping {
    fn name(&self) -> &'static str {
        "Levenberg-Marquardt (Moré)"
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
        if length.is_finite() && length <= (1.0 + RADIUS_SLACK) * self.radius {
            self.damping = 0.0;
            if self.first {
                self.radius = self.radius.min(length);
            }
            self.first = false;
            return full;
        }
        self.first = false;

        // φ(λ) = ‖D s(λ)‖ − Δ falls from φ(0) > 0; λ stays between two bounds that close in.
        let steepest = model.gradient().component_div(scale).norm();
        let mut upper = steepest / self.radius;
        let mut lower = 0.0;
        let mut damping = self.damping.clamp(lower, upper);
        if damping == 0.0 {
            damping = upper * 1e-3;
        }
        let mut damped = model.damped_step(damping, scale);
        for _ in 0..MOST_REFINEMENTS {
            let length = damped.step.component_mul(scale).norm();
            let excess = length - self.radius;
            if excess.abs() <= RADIUS_SLACK * self.radius {
                break;
            }
            if excess > 0.0 {
                lower = f64::max(lower, damping);
            } else {
                upper = f64::min(upper, damping);
            }
            // Newton on 1/‖D s(λ)‖, whose slope in λ is known from the factors.
            let correction = excess / (self.radius * damped.slope);
            let next = damping + correction;
            damping = if next > lower && next < upper {
                next
            } else {
                (lower * upper).sqrt().max(1e-3 * upper)
            };
            damped = model.damped_step(damping, scale);
        }
        self.damping = damping;
        damped.step
    }

    fn damping(&self) -> f64 {
        self.damping
    }

    fn accepted(&mut self, trial: &Trial) {
        self.update(trial);
    }

    fn rejected(&mut self, trial: &Trial) {
        self.update(trial);
    }

    fn invalid(&mut self, length: f64) {
        self.radius = 0.25 * self.radius.min(length);
        self.damping *= 4.0;
    }
}

/// The damping raised and lowered by the gain ratio.
///
/// Nielsen, "Damping parameter in Marquardt's method", IMM-REP-1999-05 (1999), eq. 2.5: after a
/// step of gain ρ it is multiplied by max(1/3, 1 − (2ρ − 1)³), after a failure by 2, 4, 8, …
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct NielsenDamping {
    initial_damping: f64,
    damping: f64,
    growth: f64,
}

/// The first factor of the damping after a failure; each further one is this much greater.
pub(super) const GROWTH: f64 = 2.0;

/// What a step of gain ρ multiplies the damping by: 1 − (2ρ − 1)³, at least `least` (Nielsen 1999,
/// eq. 2.5).
pub(super) fn nielsen_factor(gain: f64, least: f64) -> f64 {
    (1.0 - (2.0 * gain - 1.0).powi(3)).max(least)
}

impl NielsenDamping {
    /// Starts with damping λ; D carries the columns' norms, so that λ has no unit.
    pub fn new(initial_damping: f64) -> Self {
        Self {
            initial_damping,
            damping: initial_damping,
            growth: GROWTH,
        }
    }
}

impl Strategy for NielsenDamping {
    fn name(&self) -> &'static str {
        "Levenberg-Marquardt (Nielsen)"
    }

    fn begin(&mut self, _parameter_length: f64) {
        *self = Self::new(self.initial_damping);
    }

    fn step<M: LinearModel>(&mut self, model: &M, scale: &DVector<f64>) -> DVector<f64> {
        model.damped_step(self.damping, scale).step
    }

    fn damping(&self) -> f64 {
        self.damping
    }

    fn accepted(&mut self, trial: &Trial) {
        let factor = nielsen_factor(trial.gain(), 1.0 / 3.0);
        self.damping = (self.damping * factor).max(f64::MIN_POSITIVE);
        self.growth = GROWTH;
    }

    fn rejected(&mut self, _trial: &Trial) {
        self.damping *= self.growth;
        self.growth *= GROWTH;
    }

    fn invalid(&mut self, _length: f64) {
        self.damping *= self.growth;
        self.growth *= GROWTH;
    }
}
