//! The bisector of two points, and the part of it on which both are farthest or nearest of a set.
//!
//! On the bisector of two points, written c(t) = midpoint + t·w with unit w, every squared distance is
//! t² plus a straight line in t: d_k²(t) = t² + α_k + β_k t. So which point is farthest or nearest is a
//! set of linear inequalities in t. These parts are the edges of the farthest-point and of the
//! nearest-point Voronoi diagram.

use super::points::Point;

/// Which diagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Diagram {
    /// Both points are farther than all others.
    Farthest,
    /// Both points are nearer than all others.
    Nearest,
}

/// A piece of a bisector.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    middle: Point,
    /// Unit vector along the bisector.
    pub(super) along: Point,
    /// Square of half the distance of the two points: α of both.
    alpha: f64,
    /// The piece is low ≤ t ≤ high; the ends may be infinite.
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Edge {
    /// The edge between points `i` and `j` of a set of different points, if there is one.
    fn of(points: &[Point], i: usize, j: usize, diagram: Diagram) -> Option<Self> {
        let (a, b) = (points[i], points[j]);
        let half = Point::new(0.5 * (b.x - a.x), 0.5 * (b.y - a.y));
        let alpha = half.dot(half);
        let length = alpha.sqrt();
        if length == 0.0 {
            return None;
        }
        let mut edge = Self {
            middle: a.plus(half),
            along: Point::new(-half.y / length, half.x / length),
            alpha,
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
        };
        let sign = match diagram {
            Diagram::Farthest => 1.0,
            Diagram::Nearest => -1.0,
        };
        let others = || (0..points.len()).filter(|&k| k != i && k != j);
        // By how much point k takes the edge from the two at t; beyond rounding when positive.
        let beyond = |edge: &Self, k: usize, t: f64| {
            let (alpha_k, beta_k) = edge.line(points[k]);
            let slack = 16.0 * f64::EPSILON * (1.0 + alpha + alpha_k + (beta_k * t).abs());
            sign * (alpha_k - alpha + beta_k * t) > slack
        };
        let mut reversed = false;
        for k in others() {
            let (alpha_k, beta_k) = edge.line(points[k]);
            let slope = sign * beta_k;
            let t = (alpha - alpha_k) / beta_k;
            if slope > 0.0 {
                edge.high = edge.high.min(t);
            } else if slope < 0.0 {
                edge.low = edge.low.max(t);
            } else if sign * (alpha_k - alpha) > 0.0 {
                return None;
            }
            if edge.low > edge.high {
                // Four points on one circle make an edge of length zero, which rounding turns round.
                reversed = true;
                if beyond(&edge, k, 0.5 * (edge.low + edge.high)) {
                    return None;
                }
            }
        }
        if reversed {
            let t = 0.5 * (edge.low + edge.high);
            if others().any(|k| beyond(&edge, k, t)) {
                return None;
            }
            (edge.low, edge.high) = (t, t);
        }
        Some(edge)
    }

    /// (α, β) of the squared distance of a point along this bisector.
    pub(super) fn line(&self, p: Point) -> (f64, f64) {
        let from = self.middle.minus(p);
        // Adding zero makes −0 to 0, which orders of numbers tell apart.
        (from.dot(from), 2.0 * self.along.dot(from) + 0.0)
    }

    pub(super) fn at(&self, t: f64) -> Point {
        self.middle
            .plus(Point::new(t * self.along.x, t * self.along.y))
    }

    /// Squared distance of the two points from the centre at t.
    pub(super) fn square(&self, t: f64) -> f64 {
        t * t + self.alpha
    }

    /// The place on this edge nearest to its two points.
    pub(super) fn nearest(&self) -> f64 {
        0.0_f64.clamp(self.low, self.high)
    }
}

/// Every edge of the diagram of a small set of different points.
pub(super) fn edges(points: &[Point], diagram: Diagram) -> Vec<Edge> {
    let pairs = (0..points.len()).flat_map(|i| (i + 1..points.len()).map(move |j| (i, j)));
    pairs
        .filter_map(|(i, j)| Edge::of(points, i, j, diagram))
        .collect()
}
