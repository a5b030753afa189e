//! One point of the L-curve, with everything that the rules choosing λ need.

use super::RegularizationError;

/// The regularized solutions of one problem, seen only through their norms.
pub trait Family {
    /// Number of rows of A.
    fn row_count(&self) -> usize;

    /// The smallest and the largest λ between which the solution changes.
    fn range(&self) -> (f64, f64);

    /// The norms at λ.
    ///
    /// # Errors
    /// λ not positive, or the factorisation at this λ broke down.
    fn point(&self, lambda: f64) -> Result<Point, RegularizationError>;

    /// How many λ over the range a rule may look at before it refines.
    fn samples(&self) -> usize {
        200
    }

    /// The norms at several λ.
    ///
    /// # Errors
    /// As [`point`](Self::point).
    fn points(&self, lambdas: &[f64]) -> Result<Vec<Point>, RegularizationError> {
        lambdas.iter().map(|lambda| self.point(*lambda)).collect()
    }
}

/// The norms of the regularized solution at one λ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// λ, in the unit that makes λ‖Lx‖ a residual.
    pub lambda: f64,
    /// ‖Ax − b‖.
    pub residual_norm: f64,
    /// ‖Lx‖.
    pub seminorm: f64,
    /// d‖Lx‖²/dλ, never positive.
    pub seminorm_sq_slope: f64,
    /// Trace of the influence matrix: how many parameters the data were spent on.
    pub effective_parameters: f64,
}

impl Point {
    /// Minus the slope d log‖Lx‖ / d log‖Ax − b‖ of the L-curve, ‖Ax − b‖² / (λ²‖Lx‖²).
    ///
    /// Follows from d‖Ax − b‖² = −λ² d‖Lx‖² (Hansen, Rank-Deficient and Discrete Ill-Posed
    /// Problems, 1998, section 4.6): no second derivative is needed.
    pub fn steepness(&self) -> f64 {
        (self.residual_norm / (self.lambda * self.seminorm)).powi(2)
    }

    /// The angle of the tangent below the horizontal, from 0 (flat) to π/2 (upright).
    pub fn tangent_angle(&self) -> f64 {
        self.steepness().atan()
    }

    /// Signed curvature of (log‖Ax − b‖, log‖Lx‖): positive where the curve is convex, as at the
    /// corner of an L. Not finite where a norm is zero.
    ///
    /// With q the [steepness](Self::steepness) and ρ̂ = log‖Ax − b‖ it is −(dq/dρ̂)/(1 + q²)^{3/2}.
    pub fn curvature(&self) -> f64 {
        let q = self.steepness();
        let rho = self.residual_norm.powi(2);
        let eta = self.seminorm.powi(2);
        let slope = self.seminorm_sq_slope;
        let log_rho_slope = -self.lambda.powi(2) * slope / (2.0 * rho);
        // d log q = d log ρ − 2 d log λ − d log η, with ρ, η the squared norms.
        let log_q_slope = 2.0 * log_rho_slope - 2.0 / self.lambda - slope / eta;
        -q * log_q_slope / (log_rho_slope * (1.0 + q * q).powf(1.5))
    }

    /// Degrees of freedom left for the noise, m − trace of the influence matrix.
    pub fn residual_degrees_of_freedom(&self, row_count: usize) -> f64 {
        row_count as f64 - self.effective_parameters
    }

    /// Standard deviation of one row's noise as the residuals show it; absent when no degree of
    /// freedom is left.
    pub fn noise_estimate(&self, row_count: usize) -> Option<f64> {
        let left = self.residual_degrees_of_freedom(row_count);
        (left > 0.0).then(|| self.residual_norm / left.sqrt())
    }
}
