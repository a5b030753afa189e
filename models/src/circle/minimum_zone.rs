//! The two concentric circles of least separation that hold all points between them.
//!
//! The separation of some of the points is at most that of all. So the exact optimum of a few points
//! bounds the optimum of all from below, its centre gives a bound from above, and the points that
//! are nearest and farthest there join the few until both bounds meet: then the optimum is proved.

use super::bisector::{Diagram, Edge, edges};
use super::contacts::{Extremes, Few};
use super::points::{CircleError, FLAT, Point};

/// Where the centre of a zone lies.
#[derive(Debug, Clone, Copy)]
enum Place {
    Centre(Point),
    /// So far away in this direction that the zone is a straight strip.
    Beyond(Point),
}

impl Place {
    /// Nearest point, farthest point and width of the zone.
    fn zone(self, points: &[Point]) -> (Point, Point, f64) {
        match self {
            Self::Centre(centre) => {
                let found = Extremes::about(points, centre);
                (found.nearest, found.farthest, found.width())
            }
            Self::Beyond(direction) => {
                let mut low = (f64::INFINITY, Point::default());
                let mut high = (f64::NEG_INFINITY, Point::default());
                for &p in points {
                    let height = direction.dot(p);
                    if height < low.0 {
                        low = (height, p);
                    }
                    if height > high.0 {
                        high = (height, p);
                    }
                }
                (high.1, low.1, high.0 - low.0)
            }
        }
    }
}

/// The centre of the minimum zone of `points` in coordinates of magnitude one, from any start.
///
/// # Errors
/// [`CircleError::StraighterThanAnyCircle`] where no ring is narrower than the narrowest strip.
pub(super) fn minimum_zone_centre(points: &[Point], start: Point) -> Result<Point, CircleError> {
    let mut few = Few::about(points, start);
    let mut best = (f64::INFINITY, Place::Centre(start));
    while let Some((bound, place)) = zone_of_few(few.points()) {
        let (nearest, farthest, width) = place.zone(points);
        if width < best.0 {
            best = (width, place);
        }
        let new = few.add(nearest) | few.add(farthest);
        if best.0 - bound <= ROUNDING || !new {
            break;
        }
    }
    match best.1 {
        Place::Centre(centre) if centre.dot(centre) < FLAT * FLAT => Ok(centre),
        _ => Err(CircleError::StraighterThanAnyCircle),
    }
}

/// What two evaluations of one width, in coordinates of magnitude one, may differ by.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The least width of a few points and where it is reached.
///
/// At a minimum two outer and two inner contacts alternate: the gradient of an outer distance is a
/// unit vector, and the hulls of the outer and of the inner unit vectors must meet, which on a circle
/// needs two chords that cross. Such a centre lies where an edge of the farthest-point Voronoi diagram
/// crosses one of the nearest-point diagram, so that walking all edges of the first finds it, also
/// where there are many local minima.
fn zone_of_few(points: &[Point]) -> Option<(f64, Place)> {
    let mut best: Option<(f64, Place)> = None;
    let mut offer = |width: f64, place: Place| {
        if best.is_none_or(|(w, _)| width < w) {
            best = Some((width, place));
        }
    };
    let mut lines = Vec::with_capacity(points.len());
    for edge in edges(points, Diagram::Farthest) {
        walk(&edge, points, &mut lines, &mut offer);
    }
    best
}

/// Follows the nearest point along the bisector of an edge of the farthest-point diagram, the lower
/// envelope of the lines α + βt, from one end of the world to the other, and offers every place of the
/// edge where it changes, and its ends. To begin at the edge's end would be cheaper, but where that is
/// far away rounding hides which of two parallel lines is the lower.
fn walk(
    edge: &Edge,
    points: &[Point],
    lines: &mut Vec<(f64, f64)>,
    offer: &mut impl FnMut(f64, Place),
) {
    lines.clear();
    lines.extend(points.iter().map(|&p| edge.line(p)));
    let mut offer_at = |t: f64| {
        let centre = edge.at(t);
        offer(
            Extremes::about(points, centre).width(),
            Place::Centre(centre),
        );
    };
    let first = lines
        .iter()
        .copied()
        .min_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
    let Some(first) = first else { return };
    let (mut t, mut nearest) = (f64::NEG_INFINITY, first);
    // Each step goes to a line of lesser slope, so that there are at most as many as points.
    loop {
        let next = lines
            .iter()
            .filter(|line| line.1 < nearest.1)
            .map(|&line| (((line.0 - nearest.0) / (nearest.1 - line.1)).max(t), line))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.1.total_cmp(&b.1.1)));
        let Some((crossing, line)) = next else { break };
        if crossing > edge.high {
            break;
        }
        if crossing >= edge.low {
            offer_at(crossing);
        }
        t = crossing;
        nearest = line;
    }
    for end in [edge.low, edge.high] {
        if end.is_finite() {
            offer_at(end);
        }
    }
    if edge.low == f64::NEG_INFINITY {
        let back = Point::new(-edge.along.x, -edge.along.y);
        offer(0.5 * first.1, Place::Beyond(back));
    }
    if edge.high == f64::INFINITY {
        offer(-0.5 * nearest.1, Place::Beyond(edge.along));
    }
}
