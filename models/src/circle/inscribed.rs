//! The largest circle that no point is inside of and that three points hold on all sides.
//!
//! Its centre lies within the triangle of its contacts, so within the convex hull. The largest empty
//! circle centred in the hull is found by exchange: leaving out points and sides of the hull can
//! only make it larger. Where it is held on all sides it is the one sought. Otherwise, as among points
//! that are no ring at all, every triangle of the Delaunay triangulation is looked at.

use super::bisector::{Diagram, Edge, Kind};
use super::contacts::{Extremes, Few, First, all_on_one_side};
use super::points::{Point, circumcentre};
use spade::{DelaunayTriangulation, Point2, Triangulation};

/// Exchanges after which the points are taken for no ring.
const MOST_EXCHANGES: usize = 40;

/// Centre and radius in coordinates of magnitude one, from the first points of a search, or nothing where no three points
/// surround an empty circle.
pub(super) fn largest_inscribed(points: &[Point], first: &First) -> Option<(Point, f64)> {
    by_exchange(points, first).or_else(|| by_triangles(points))
}

/// The largest empty circle centred in the hull, if it is held on all sides.
fn by_exchange(points: &[Point], first: &First) -> Option<(Point, f64)> {
    let mut few = Few::of(first.inner());
    let mut diagram = Diagram::of(few.points(), Kind::Nearest);
    let mut hull = Polygon::around(points)?;
    for _ in 0..MOST_EXCHANGES {
        let (square, centre) = largest_of_few(few.points(), &diagram, &hull)?;
        let found = Extremes::about(points, centre);
        let outside = all_on_one_side(points, centre);
        // What two evaluations of one radius differ by from rounding.
        let rounding = 4.0 * f64::EPSILON * (1.0 + square.sqrt());
        let empty = square.sqrt() - found.inner() <= rounding;
        match (outside, empty) {
            (None, true) => {
                return held(points, centre, found.inner()).then_some((centre, found.inner()));
            }
            (None, false) => {
                if !few.add(found.nearest) {
                    return held(points, centre, found.inner()).then_some((centre, found.inner()));
                }
                diagram.add(found.nearest);
            }
            (Some(inwards), _) => {
                if few.add(found.nearest) {
                    diagram.add(found.nearest);
                }
                let outwards = Point::new(-inwards.x, -inwards.y);
                let border = points
                    .iter()
                    .map(|p| p.dot(outwards))
                    .fold(f64::NEG_INFINITY, f64::max);
                hull.cut(outwards, border);
            }
        }
    }
    None
}

/// Centre and squared radius of the largest circle without one of a few points inside, its centre in
/// the polygon. The squared distance from the nearest point is convex on each Voronoi cell, so that it
/// is greatest at a corner of a cell, at the border's crossing with an edge, or at a corner of the border.
fn largest_of_few(points: &[Point], diagram: &Diagram, hull: &Polygon) -> Option<(f64, Point)> {
    let mut best: Option<(f64, Point)> = None;
    let mut offer = |square: f64, centre: Point| {
        if best.is_none_or(|(s, _)| square > s) {
            best = Some((square, centre));
        }
    };
    for edge in diagram.edges() {
        if let Some((low, high)) = hull.within(edge) {
            offer(edge.square(low), edge.at(low));
            offer(edge.square(high), edge.at(high));
        }
    }
    for &corner in &hull.corners {
        let squares = points.iter().map(|p| {
            let q = p.minus(corner);
            q.dot(q)
        });
        offer(squares.fold(f64::INFINITY, f64::min), corner);
    }
    best
}

/// Whether the contacts leave no half circle free.
fn held(points: &[Point], centre: Point, radius: f64) -> bool {
    let reach = radius + 64.0 * f64::EPSILON * (1.0 + radius);
    let contacts = points.iter().filter(|p| p.distance(centre) <= reach);
    let mut angles: Vec<f64> = contacts
        .map(|p| (p.y - centre.y).atan2(p.x - centre.x))
        .collect();
    angles.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else {
        return false;
    };
    let across = first + std::f64::consts::TAU - last;
    let widest = angles
        .windows(2)
        .map(|w| w[1] - w[0])
        .fold(across, f64::max);
    angles.len() > 2 && widest <= std::f64::consts::PI + SLACK
}

/// What rounding may turn a contact by, rad.
const SLACK: f64 = 1e-12;

fn by_triangles(points: &[Point]) -> Option<(Point, f64)> {
    let sites = points.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let triangulation = DelaunayTriangulation::<Point2<f64>>::bulk_load(sites).ok()?;
    let mut best: Option<(Point, f64)> = None;
    for face in triangulation.inner_faces() {
        let contacts = face.positions().map(|p| Point::new(p.x, p.y));
        let Some(centre) = circumcentre(contacts[0], contacts[1], contacts[2]) else {
            continue;
        };
        let radius = centre.distance(contacts[0]);
        if best.is_none_or(|(_, r)| radius > r) && surrounds(contacts, centre, radius) {
            best = Some((centre, radius));
        }
    }
    best
}

/// Whether the centre lies within the triangle of its contacts, sides included.
fn surrounds(contacts: [Point; 3], centre: Point, radius: f64) -> bool {
    let [a, b, c] = contacts;
    let turns = [(a, b), (b, c), (c, a)].map(|(p, q)| {
        let side = q.minus(p);
        let slack = SLACK * side.dot(side).sqrt() * radius;
        (side.cross(centre.minus(p)), slack)
    });
    turns.iter().all(|(turn, slack)| *turn >= -slack)
        || turns.iter().all(|(turn, slack)| *turn <= *slack)
}

/// A convex polygon that holds the hull.
struct Polygon {
    corners: Vec<Point>,
    /// Its sides: outward normal n and n·x on the side.
    sides: Vec<(Point, f64)>,
}

impl Polygon {
    /// The box around the points.
    fn around(points: &[Point]) -> Option<Self> {
        let (mut low, mut high) = (*points.first()?, *points.first()?);
        for p in points {
            low = Point::new(low.x.min(p.x), low.y.min(p.y));
            high = Point::new(high.x.max(p.x), high.y.max(p.y));
        }
        Some(Self {
            corners: vec![
                low,
                Point::new(high.x, low.y),
                high,
                Point::new(low.x, high.y),
            ],
            sides: vec![
                (Point::new(1.0, 0.0), high.x),
                (Point::new(-1.0, 0.0), -low.x),
                (Point::new(0.0, 1.0), high.y),
                (Point::new(0.0, -1.0), -low.y),
            ],
        })
    }

    /// Cuts off what lies beyond n·x = border.
    fn cut(&mut self, normal: Point, border: f64) {
        let excess = |p: Point| p.dot(normal) - border;
        let mut kept = Vec::with_capacity(self.corners.len() + 1);
        for (k, &here) in self.corners.iter().enumerate() {
            let next = self.corners[(k + 1) % self.corners.len()];
            let (e, f) = (excess(here), excess(next));
            if e <= 0.0 {
                kept.push(here);
            }
            if (e <= 0.0) != (f <= 0.0) {
                let share = e / (e - f);
                kept.push(here.plus(Point::new(
                    share * (next.x - here.x),
                    share * (next.y - here.y),
                )));
            }
        }
        self.corners = kept;
        self.sides.push((normal, border));
    }

    /// The part low ≤ t ≤ high of an edge that lies within.
    fn within(&self, edge: &Edge) -> Option<(f64, f64)> {
        let (mut low, mut high) = (edge.low, edge.high);
        let origin = edge.at(0.0);
        for &(normal, border) in &self.sides {
            let slope = normal.dot(edge.along);
            let rest = border - normal.dot(origin);
            if slope > 0.0 {
                high = high.min(rest / slope);
            } else if slope < 0.0 {
                low = low.max(rest / slope);
            } else if rest < 0.0 {
                return None;
            }
        }
        (low <= high).then_some((low, high))
    }
}
