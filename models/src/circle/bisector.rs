//! The bisector of two points, and the part of it on which both are farthest or nearest of a set.
//!
//! On the bisector of two points, written c(t) = midpoint + t·w with unit w, every squared distance is
//! t² plus a straight line in t: d_k²(t) = t² + α_k + β_k t. So which point is farthest or nearest is a
//! set of linear inequalities in t. These parts are the edges of the farthest-point and of the
//! nearest-point Voronoi diagram.

use super::points::Point;

/// Which diagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
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
    /// 1 in the farthest-point diagram, −1 in the nearest-point one.
    sign: f64,
    /// The piece is low ≤ t ≤ high; the ends may be infinite.
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Edge {
    /// The edge between two different points of a set, if there is one. That there is none is found soonest
    /// where the farthest points, or the nearest, stand first.
    fn of(points: &[Point], i: usize, j: usize, kind: Kind) -> Option<Self> {
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
            sign: match kind {
                Kind::Farthest => 1.0,
                Kind::Nearest => -1.0,
            },
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
        };
        let others = || (0..points.len()).filter(|&k| k != i && k != j);
        let mut reversed = false;
        for k in others() {
            if !edge.cut(points[k])? {
                reversed = true;
            }
        }
        if reversed {
            let t = 0.5 * (edge.low + edge.high);
            if others().any(|k| edge.beyond(points[k], t)) {
                return None;
            }
            (edge.low, edge.high) = (t, t);
        }
        Some(edge)
    }

    /// Cuts off what another point takes; nothing where it takes all. False where the ends have passed each
    /// other: four points on one circle make an edge of length zero, which rounding turns round.
    #[inline]
    fn cut(&mut self, p: Point) -> Option<bool> {
        let (alpha, beta) = self.line(p);
        let slope = self.sign * beta;
        // The quotient is needed only where it is the new end.
        if slope > 0.0 {
            if self.high * beta * self.sign > (self.alpha - alpha) * self.sign {
                self.high = self.high.min((self.alpha - alpha) / beta);
            }
        } else if slope < 0.0 {
            if self.low * beta * self.sign > (self.alpha - alpha) * self.sign {
                self.low = self.low.max((self.alpha - alpha) / beta);
            }
        } else if self.sign * (alpha - self.alpha) > 0.0 {
            return None;
        }
        if self.low <= self.high {
            return Some(true);
        }
        (!self.beyond(p, 0.5 * (self.low + self.high))).then_some(false)
    }

    /// Whether a point takes the place t from the two, by more than rounding.
    fn beyond(&self, p: Point, t: f64) -> bool {
        let (alpha, beta) = self.line(p);
        let slack = 16.0 * f64::EPSILON * (1.0 + self.alpha + alpha + (beta * t).abs());
        self.sign * (alpha - self.alpha + beta * t) > slack
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

/// The edges of the diagram of a small set of different points.
#[derive(Debug)]
pub(super) struct Diagram {
    kind: Kind,
    sites: Vec<Point>,
    edges: Vec<Edge>,
}

impl Diagram {
    /// That of these points.
    pub(super) fn of(points: &[Point], kind: Kind) -> Self {
        let sites = points.to_vec();
        let pairs = (0..sites.len()).flat_map(|i| (i + 1..sites.len()).map(move |j| (i, j)));
        Self {
            kind,
            edges: pairs
                .filter_map(|(i, j)| Edge::of(&sites, i, j, kind))
                .collect(),
            sites,
        }
    }

    /// Adds a point that differs from all before.
    pub(super) fn add(&mut self, p: Point) {
        let sites = &self.sites;
        self.edges.retain_mut(|edge| match edge.cut(p) {
            None => false,
            Some(true) => true,
            Some(false) => {
                let t = 0.5 * (edge.low + edge.high);
                (edge.low, edge.high) = (t, t);
                !sites.iter().any(|&q| edge.beyond(q, t))
            }
        });
        self.sites.push(p);
        let last = self.sites.len() - 1;
        let new = (0..last).filter_map(|i| Edge::of(&self.sites, i, last, self.kind));
        self.edges.extend(new);
    }

    /// Its points.
    pub(super) fn sites(&self) -> &[Point] {
        &self.sites
    }

    /// Its edges.
    pub(super) fn edges(&self) -> &[Edge] {
        &self.edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn points_added_one_by_one_make_the_same_diagram() {
        for (seed, kind) in (0..200).flat_map(|s| [(s, Kind::Nearest), (s, Kind::Farthest)]) {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let points: Vec<Point> = (0..12)
                .map(|_| Point::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)))
                .collect();
            let mut grown = Diagram::of(&points[..2], kind);
            for &p in &points[2..] {
                grown.add(p);
            }
            let whole = Diagram::of(&points, kind);
            assert_eq!(grown.edges().len(), whole.edges().len(), "{seed} {kind:?}");
            for edge in whole.edges() {
                // epsilons: the same quotients, in another order
                let same = |other: &&Edge| other.middle.distance(edge.middle) < 1e-15;
                let other = grown.edges().iter().find(same).unwrap();
                for (a, b) in [(edge.low, other.low), (edge.high, other.high)] {
                    assert!(
                        a == b || (a - b).abs() <= 1e-12 * (1.0 + a.abs()),
                        "{seed} {kind:?}"
                    );
                }
            }
        }
    }
}
