//! Passes over all points: who is nearest and farthest, and the few points with which a search begins.
//!
//! The reference circles depend on a handful of contacts. Each is found by exchange: the question is
//! answered exactly for a few points; a pass over all points finds those that contradict the answer;
//! they join the few. When none contradicts, the answer for the few is the answer for all, because
//! leaving points out can only make a zone narrower, a circumscribed circle smaller, an empty circle
//! larger.

use super::points::Point;

/// The few points that stand for all. Different from each other.
#[derive(Debug, Clone, Default)]
pub(super) struct Few {
    points: Vec<Point>,
}

impl Few {
    /// These, each once.
    pub(super) fn of(points: impl IntoIterator<Item = Point>) -> Self {
        let mut few = Self::default();
        for p in points {
            few.add(p);
        }
        few
    }

    /// Adds a point; false where it is among them.
    pub(super) fn add(&mut self, p: Point) -> bool {
        let new = !self.points.contains(&p);
        if new {
            self.points.push(p);
        }
        new
    }

    pub(super) fn points(&self) -> &[Point] {
        &self.points
    }
}

/// Points with which a search begins.
#[derive(Debug, Clone)]
pub(super) struct First {
    /// The first point and the one farthest from it, so that there are two also where one sector holds an
    /// exact arc.
    pub(super) apart: [Point; 2],
    /// For each of eight sectors about a centre the nearest point, where there is one, in order.
    nearest: [Option<Point>; 8],
    /// The farthest, the other way round.
    farthest: [Option<Point>; 8],
}

impl First {
    /// Of at least one point.
    pub(super) fn about(points: &[Point], centre: Point) -> Self {
        let mut nearest = [(f64::INFINITY, None); 8];
        let mut farthest = [(f64::NEG_INFINITY, None); 8];
        for &p in points {
            let q = p.minus(centre);
            let sector = usize::from(q.x > 0.0)
                + 2 * usize::from(q.y > 0.0)
                + 4 * usize::from(q.x.abs() > q.y.abs());
            let square = q.dot(q);
            if square < nearest[sector].0 {
                nearest[sector] = (square, Some(p));
            }
            if square > farthest[sector].0 {
                farthest[sector] = (square, Some(p));
            }
        }
        nearest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        farthest.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let first = points.first().copied().unwrap_or_default();
        Self {
            apart: [first, Extremes::about(points, first).farthest],
            nearest: nearest.map(|n| n.1),
            farthest: farthest.map(|f| f.1),
        }
    }

    /// The nearest of each sector and the two points apart.
    pub(super) fn inner(&self) -> impl Iterator<Item = Point> {
        self.nearest.into_iter().flatten().chain(self.apart)
    }

    /// The farthest of each sector and the two points apart.
    pub(super) fn outer(&self) -> impl Iterator<Item = Point> {
        self.farthest.into_iter().flatten().chain(self.apart)
    }
}

/// The nearest and the farthest point from a centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extremes {
    pub(super) nearest: Point,
    pub(super) farthest: Point,
    centre: Point,
}

impl Extremes {
    /// Of at least one point, in coordinates of magnitude one.
    pub(super) fn about(points: &[Point], centre: Point) -> Self {
        if centre.dot(centre) < FAR * FAR {
            Self::by(points, centre, |p| {
                let q = p.minus(centre);
                q.dot(q)
            })
        } else {
            // |p − c|² − |c|² = p·(p − 2c) keeps the digits that squares of great distances lose.
            let twice = centre.plus(centre);
            Self::by(points, centre, |p| p.dot(p.minus(twice)))
        }
    }

    /// The nearest of some points and the farthest of others, in coordinates of magnitude one.
    pub(super) fn between(nearest: &[Point], farthest: &[Point], centre: Point) -> Self {
        Self {
            nearest: Self::about(nearest, centre).nearest,
            farthest: Self::about(farthest, centre).farthest,
            centre,
        }
    }

    fn by(points: &[Point], centre: Point, square: impl Fn(Point) -> f64) -> Self {
        let mut nearest = (f64::INFINITY, Point::default());
        let mut farthest = (f64::NEG_INFINITY, Point::default());
        for &p in points {
            let square = square(p);
            if square < nearest.0 {
                nearest = (square, p);
            }
            if square > farthest.0 {
                farthest = (square, p);
            }
        }
        Self {
            nearest: nearest.1,
            farthest: farthest.1,
            centre,
        }
    }

    pub(super) fn inner(&self) -> f64 {
        let q = self.nearest.minus(self.centre);
        q.dot(q).sqrt()
    }

    pub(super) fn outer(&self) -> f64 {
        let q = self.farthest.minus(self.centre);
        q.dot(q).sqrt()
    }

    /// Outer less inner, (D² − d²)/(D + d) with D² − d² = (f − n)·(f + n − 2c), which keeps its digits
    /// when the centre is far away.
    pub(super) fn width(&self) -> f64 {
        let sum = self.outer() + self.inner();
        if sum == 0.0 {
            return 0.0;
        }
        let (f, n) = (
            self.farthest.minus(self.centre),
            self.nearest.minus(self.centre),
        );
        self.farthest.minus(self.nearest).dot(f.plus(n)) / sum
    }
}

/// Distance of a centre, in coordinates of magnitude one, from which it counts as far.
const FAR: f64 = 10.0;

/// Where a centre lies outside the convex hull of the points or on its border: a direction from it
/// in which all points lie. Nothing where the points surround it.
pub(super) fn all_on_one_side(points: &[Point], centre: Point) -> Option<Point> {
    let mut rays = points.iter().map(|p| p.minus(centre));
    let first = rays.next()?;
    let (mut left, mut right) = (first, first);
    for q in rays {
        let (beyond_left, beyond_right) = (left.cross(q) > 0.0, right.cross(q) < 0.0);
        match (beyond_left, beyond_right) {
            (true, true) => return None,
            (true, false) => left = q,
            (false, true) => right = q,
            // Within the rays, or straight opposite them, which makes the centre a point of the border.
            (false, false) => {
                if left.dot(q) < 0.0 && right.dot(q) < 0.0 {
                    return None;
                }
            }
        }
    }
    let unit = |q: Point| {
        let length = q.dot(q).sqrt();
        (length > 0.0).then(|| Point::new(q.x / length, q.y / length))
    };
    unit(unit(left)?.plus(unit(right)?))
}
