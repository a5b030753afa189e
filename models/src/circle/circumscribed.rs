//! The smallest circle around all points.

use super::bisector::{Diagram, Kind};
use super::contacts::{Extremes, Few};
use super::points::Point;

/// Centre and radius, in coordinates of magnitude one, from two points far apart; nothing where they are
/// the same.
///
/// The smallest circle around a few points is at most that around all; the point that sticks out of it
/// farthest joins the few until none does.
pub(super) fn smallest_circumscribed(points: &[Point], apart: [Point; 2]) -> Option<(Point, f64)> {
    let mut few = Few::of(apart);
    let mut diagram = Diagram::of(few.points(), Kind::Farthest);
    loop {
        let (square, centre) = diagram
            .edges()
            .iter()
            .map(|edge| (edge.square(edge.nearest()), edge.at(edge.nearest())))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let found = Extremes::about(points, centre);
        // What two evaluations of one radius differ by from rounding.
        let rounding = 4.0 * f64::EPSILON * (1.0 + square.sqrt());
        if found.outer() - square.sqrt() <= rounding || !few.add(found.farthest) {
            return Some((centre, found.outer()));
        }
        diagram.add(found.farthest);
    }
}
