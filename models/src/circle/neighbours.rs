//! What part of a circle the points cover, and whether neighbouring deviations are alike, as form is and
//! noise is not.

use std::collections::BTreeMap;

use super::orthogonal::CircleFit;
use super::passes::rows_of;
use super::points::Point;
use nalgebra::{DMatrix, Matrix3};
use statrs::distribution::{ContinuousCDF, Normal};

impl CircleFit {
    /// The arc that the fitted `points` cover, rad: the circle less the widest gap between neighbours,
    /// seen from the fitted centre. Evenly spaced points of a full circle lack one spacing.
    pub fn covered_arc(&self, points: &[Point]) -> f64 {
        std::f64::consts::TAU - around(points, self.circle.centre).1
    }

    /// Root mean square of the deviations, µm.
    fn rms_um(&self) -> f64 {
        let squares: f64 = self.residuals_um.iter().map(|d| d * d).sum();
        (squares / self.residuals_um.len() as f64).sqrt()
    }

    /// Whether the deviations are no more than the rounding of the coordinates.
    pub(super) fn is_rounding(&self) -> bool {
        let c = self.circle;
        let magnitude = c.radius + c.centre.x.abs().max(c.centre.y.abs());
        self.rms_um() <= 1e3 * 64.0 * f64::EPSILON * magnitude
    }

    /// The probability that independent deviations of the fitted `points` would have neighbours as much
    /// alike as these: von Neumann's ratio of squared successive differences to squares, in each pass in the
    /// order of the angle from the widest gap on, against its mean and variance for the residuals of this fit
    /// (their ratio is independent of the sum of squares, E. J. G. Pitman 1937), taken as normal. `passes`: the
    /// pass of each point.
    ///
    /// Nothing where the deviations are rounding, or fewer than four degrees of freedom are left.
    pub fn neighbours_alike(&self, points: &[Point], passes: &[usize]) -> Option<f64> {
        let n = points.len();
        let c = self.circle;
        let rms_um = self.rms_um();
        let of_all = n == self.residuals_um.len() && n == passes.len();
        if !of_all || self.degrees_of_freedom < 4 || self.is_rounding() {
            return None;
        }
        let mut last = BTreeMap::new();
        let (order, _) = around(points, c.centre);
        let pair = |row: usize| Some([last.insert(passes[row], row)?, row]);
        let pairs: Vec<[usize; 2]> = order.into_iter().filter_map(pair).collect();
        let d = |row: usize| self.residuals_um[row] / rms_um;
        let ratio = pairs
            .iter()
            .map(|[a, b]| (d(*b) - d(*a)).powi(2))
            .sum::<f64>()
            / n as f64;
        // With A the matrix of squared differences, Q an orthonormal basis of the fit's columns and
        // R = 1 − QQᵀ: E = tr(AR)/ν, Var = 2 (ν tr(ARAR) − tr²(AR)) / (ν²(ν + 2)).
        let q = self.jacobian.clone().qr().q();
        let mut aq = DMatrix::zeros(n, 3);
        for [a, b] in &pairs {
            for k in 0..3 {
                let step = q[(*b, k)] - q[(*a, k)];
                aq[(*b, k)] += step;
                aq[(*a, k)] -= step;
            }
        }
        let within: Matrix3<f64> = Matrix3::from_fn(|i, j| q.column(i).dot(&aq.column(j)));
        let nu = self.degrees_of_freedom as f64;
        let trace = 2.0 * pairs.len() as f64 - within.trace();
        // tr(A²) of a chain of m points is 6m − 8, of one point none.
        let chains = rows_of(passes).into_iter().map(|own| own.len());
        let chains = chains.filter(|m| *m > 1);
        let squares: f64 = chains.map(|m| 6.0 * m as f64 - 8.0).sum();
        let trace_of_square = squares - 2.0 * aq.norm_squared() + within.norm_squared();
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
