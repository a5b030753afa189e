//! What part of a circle the points cover, and whether neighbouring deviations are alike, as form is and
//! noise is not.

use super::orthogonal::CircleFit;
use super::points::Point;
use nalgebra::Matrix3;
use statrs::distribution::{ContinuousCDF, Normal};

impl CircleFit {
    /// The arc that the fitted `points` cover, rad: the circle less the widest gap between neighbours,
    /// seen from the fitted centre. Evenly spaced points of a full circle lack one spacing.
    pub fn covered_arc(&self, points: &[Point]) -> f64 {
        std::f64::consts::TAU - around(points, self.circle.centre).1
    }

    /// The probability that independent deviations of the fitted `points` would have neighbours as much
    /// alike as these: von Neumann's ratio of squared successive differences to squares, in the order of
    /// the angle from the widest gap on, against its mean and variance for the residuals of this fit
    /// (their ratio is independent of the sum of squares, E. J. G. Pitman 1937), taken as normal.
    ///
    /// Nothing where the deviations are rounding, or fewer than four degrees of freedom are left.
    pub fn neighbours_alike(&self, points: &[Point]) -> Option<f64> {
        let n = points.len();
        let c = self.circle;
        let magnitude = c.radius + c.centre.x.abs().max(c.centre.y.abs());
        let rms_um = (self.residuals_um.iter().map(|d| d * d).sum::<f64>() / n as f64).sqrt();
        let rounding = rms_um <= 1e3 * 64.0 * f64::EPSILON * magnitude;
        if n != self.residuals_um.len() || self.degrees_of_freedom < 4 || rounding {
            return None;
        }
        let (order, _) = around(points, c.centre);
        let d: Vec<f64> = order
            .iter()
            .map(|&i| self.residuals_um[i] / rms_um)
            .collect();
        let squares: f64 = d.iter().map(|v| v * v).sum();
        let ratio = d.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / squares;
        // With A the matrix of squared differences, Q an orthonormal basis of the fit's columns and
        // R = 1 − QQᵀ: E = tr(AR)/ν, Var = 2 (ν tr(ARAR) − tr²(AR)) / (ν²(ν + 2)).
        let q = self.jacobian.select_rows(&order).qr().q();
        let mut aq = q.clone();
        for i in 0..n {
            for k in 0..3 {
                let left = if i > 0 {
                    q[(i, k)] - q[(i - 1, k)]
                } else {
                    0.0
                };
                let right = if i + 1 < n {
                    q[(i, k)] - q[(i + 1, k)]
                } else {
                    0.0
                };
                aq[(i, k)] = left + right;
            }
        }
        let within: Matrix3<f64> = Matrix3::from_fn(|i, j| q.column(i).dot(&aq.column(j)));
        let nu = self.degrees_of_freedom as f64;
        let trace = 2.0 * (n as f64 - 1.0) - within.trace();
        let trace_of_square =
            6.0 * n as f64 - 8.0 - 2.0 * aq.norm_squared() + within.norm_squared();
        let variance = 2.0 * (nu * trace_of_square - trace * trace) / (nu * nu * (nu + 2.0));
        let z = (ratio - trace / nu) / variance.sqrt();
        z.is_finite().then(|| Normal::standard().cdf(z))
    }
}

/// The places of the points by angle, beginning after the widest gap, and that gap, rad.
fn around(points: &[Point], centre: Point) -> (Vec<usize>, f64) {
    let mut order: Vec<(f64, usize)> = points
        .iter()
        .enumerate()
        .map(|(i, p)| ((p.y - centre.y).atan2(p.x - centre.x), i))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let across = match (order.first(), order.last()) {
        (Some(first), Some(last)) => first.0 + std::f64::consts::TAU - last.0,
        _ => std::f64::consts::TAU,
    };
    let (widest, start) = order
        .windows(2)
        .enumerate()
        .map(|(k, w)| (w[1].0 - w[0].0, k + 1))
        .fold((across, 0), |a, b| if b.0 > a.0 { b } else { a });
    order.rotate_left(start);
    (order.into_iter().map(|(_, i)| i).collect(), widest)
}
