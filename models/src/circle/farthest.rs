//! The farthest-point Voronoi edges of a set of points, and what the minimum-zone and the
//! minimum circumscribed circle need of them.
//!
//! On the bisector of two points i, j, written c(t) = midpoint + t·w with unit w, every squared
//! distance is t² plus a straight line in t: d_k²(t) = t² + α_k + β_k t. So which point is farthest
//! is a set of linear inequalities in t, and which is nearest is the lower envelope of lines.

use super::points::Point;

/// The part of the bisector of two points on which both are farthest from the centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct FarthestEdge {
    middle: Point,
    along: Point,
    /// Square of half the distance of the two points: α of both.
    alpha: f64,
    low: f64,
    high: f64,
}

impl FarthestEdge {
    fn of(points: &[Point], hull: &[usize], i: usize, j: usize) -> Option<Self> {
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
        for &k in hull {
            if k == i || k == j {
                continue;
            }
            let (alpha_k, beta_k) = edge.line(points[k]);
            let t = (alpha - alpha_k) / beta_k;
            if beta_k > 0.0 {
                edge.high = edge.high.min(t);
            } else if beta_k < 0.0 {
                edge.low = edge.low.max(t);
            } else if alpha_k > alpha {
                return None;
            }
        }
        // Four points on one circle make an edge of length zero, which rounding may turn round.
        let slack = 1e-12 * (1.0 + edge.low.abs().min(edge.high.abs())) * (1.0 + length);
        if edge.low > edge.high + slack {
            return None;
        }
        if edge.low > edge.high {
            edge.high = edge.low;
        }
        Some(edge)
    }

    /// (α, β) of the squared distance of a point along this bisector.
    fn line(&self, p: Point) -> (f64, f64) {
        let from = self.middle.minus(p);
        (from.dot(from), 2.0 * self.along.dot(from))
    }

    pub(super) fn at(&self, t: f64) -> Point {
        self.middle
            .plus(Point::new(t * self.along.x, t * self.along.y))
    }

    /// The centre on this edge nearest to its two points: where their circle is smallest.
    pub(super) fn smallest(&self) -> (Point, f64) {
        let t = 0.0_f64.clamp(self.low, self.high);
        (self.at(t), (t * t + self.alpha).sqrt())
    }

    /// Walks the nearest point along the edge and hands over every centre where it changes, and the
    /// ends; returns the least width that is approached far away, where the zone becomes a strip.
    pub(super) fn zone_candidates(&self, points: &[Point], mut found: impl FnMut(Point)) -> f64 {
        let lines: Vec<(f64, f64)> = points.iter().map(|&p| self.line(p)).collect();
        let mut strip = f64::INFINITY;
        let (mut t, first) = if self.low.is_finite() {
            found(self.at(self.low));
            let low = self.low;
            let nearest = lines.iter().copied().min_by(|a, b| {
                (a.0 + a.1 * low)
                    .total_cmp(&(b.0 + b.1 * low))
                    .then(a.1.total_cmp(&b.1))
            });
            (low, nearest)
        } else {
            let nearest = lines
                .iter()
                .copied()
                .min_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
            if let Some((_, beta)) = nearest {
                strip = strip.min(0.5 * beta);
            }
            (f64::NEG_INFINITY, nearest)
        };
        let Some(mut nearest) = first else {
            return strip;
        };
        // Each step goes to a line of lesser slope, so that there are at most as many as points.
        loop {
            let next = lines
                .iter()
                .filter(|line| line.1 < nearest.1)
                .map(|&line| (((line.0 - nearest.0) / (nearest.1 - line.1)).max(t), line))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.1.total_cmp(&b.1.1)));
            let Some((crossing, line)) = next else { break };
            if crossing > self.high {
                break;
            }
            found(self.at(crossing));
            t = crossing;
            nearest = line;
        }
        if self.high.is_finite() {
            found(self.at(self.high));
        } else {
            strip = strip.min(-0.5 * nearest.1);
        }
        strip
    }
}

/// All farthest-point Voronoi edges. Their dual is the triangulation of the convex hull in which
/// every triangle's circle holds all points: on a chord, the third corner is the one that sees it
/// under the least angle.
pub(super) fn farthest_edges(points: &[Point]) -> Vec<FarthestEdge> {
    let hull = convex_hull(points);
    let mut edges = Vec::new();
    let mut push = |i: usize, j: usize| {
        edges.extend(FarthestEdge::of(points, &hull, hull[i], hull[j]));
    };
    if hull.len() < 2 {
        return edges;
    }
    let mut chords = vec![(0, hull.len() - 1)];
    while let Some((i, j)) = chords.pop() {
        push(i, j);
        if j - i < 2 {
            continue;
        }
        let (a, b) = (points[hull[i]], points[hull[j]]);
        let cotangent = |k: &usize| {
            let p = points[hull[*k]];
            let (u, v) = (a.minus(p), b.minus(p));
            u.dot(v) / u.cross(v).abs()
        };
        let third = (i + 1..j).max_by(|k, l| cotangent(k).total_cmp(&cotangent(l)));
        if let Some(k) = third {
            chords.push((i, k));
            chords.push((k, j));
        }
    }
    edges
}

/// Indices of the strictly convex hull, anticlockwise (monotone chain).
fn convex_hull(points: &[Point]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&i, &j| {
        let (a, b) = (points[i], points[j]);
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
    });
    order.dedup_by(|i, j| points[*i] == points[*j]);
    let half = |sequence: &mut dyn Iterator<Item = usize>| {
        let mut chain: Vec<usize> = Vec::new();
        for index in sequence {
            while let [.., before, last] = chain[..] {
                let turn = points[last]
                    .minus(points[before])
                    .cross(points[index].minus(points[before]));
                if turn > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(index);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut order.iter().copied());
    hull.extend(half(&mut order.iter().rev().copied()));
    hull
}
