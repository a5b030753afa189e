//! The two concentric circles of least separation that hold all points between them.
//!
//! The separation of some of the points is at most that of all. So the exact optimum of a few points
//! bounds the optimum of all from below, its centre gives a bound from above, and the points that
//! are nearest and farthest there join the few until both bounds meet: then the optimum is proved.
//! The farthest is sought among still fewer, the sites of a diagram, which bounds from below as well.

use super::bisector::{Diagram, Edge, Kind};
use super::contacts::{Extremes, Few, First};
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

/// The centre of the minimum zone of `points` in coordinates of magnitude one, from any start and the first
/// points of a search.
///
/// # Errors
/// [`CircleError::StraighterThanAnyCircle`] where no ring is narrower than the narrowest strip.
pub(super) fn minimum_zone_centre(
    points: &[Point],
    start: Point,
    first: &First,
) -> Result<Point, CircleError> {
    let mut outer = Few::of(first.outer());
    let mut few = Few::of(first.outer().chain(first.inner()));
    let mut diagram = Diagram::of(outer.points(), Kind::Farthest);
    let mut best = (f64::INFINITY, Place::Centre(start));
    let at_start = Extremes::about(points, start).width();
    while let Some((bound, place)) = zone_of_few(few.points(), &diagram, at_start.min(best.0)) {
        let (nearest, farthest, width) = place.zone(points);
        if width < best.0 {
            best = (width, place);
        }
        let new = outer.add(farthest);
        if new {
            diagram.add(farthest);
            few.add(farthest);
        }
        if best.0 - bound <= ROUNDING || !(few.add(nearest) | new) {
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

/// The least width of a few points, the farthest of them sought among the sites of a diagram, and where it
/// is reached.
///
/// At a minimum two outer and two inner contacts alternate: the gradient of an outer distance is a
/// unit vector, and the hulls of the outer and of the inner unit vectors must meet, which on a circle
/// needs two chords that cross. Such a centre lies where an edge of the farthest-point Voronoi diagram
/// crosses one of the nearest-point diagram, so that walking all edges of the first finds it, also
/// where there are many local minima. As the few hold the sites, no width is negative, which one outer and
/// one inner contact alone would need for a minimum.
///
/// `reached` is a width that some place reaches: wider ones need not be looked at.
fn zone_of_few(points: &[Point], diagram: &Diagram, reached: f64) -> Option<(f64, Place)> {
    let mut best = Best {
        found: None,
        reached,
    };
    let mut lines = Vec::with_capacity(points.len());
    let points = Points {
        few: points,
        sites: diagram.sites(),
    };
    for edge in diagram.edges() {
        walk(edge, points, &mut lines, &mut best);
    }
    best.found
}

/// A few points, and those of them among which the farthest is sought.
#[derive(Debug, Clone, Copy)]
struct Points<'a> {
    few: &'a [Point],
    sites: &'a [Point],
}

/// The narrowest zone so far.
struct Best {
    found: Option<(f64, Place)>,
    reached: f64,
}

impl Best {
    fn offer(&mut self, width: f64, place: Place) {
        if self.found.is_none_or(|(w, _)| width < w) {
            self.found = Some((width, place));
            self.reached = self.reached.min(width);
        }
    }

    /// Offers a place on an edge, unless the distance from one point there, given by its line, already
    /// makes the zone too wide.
    fn offer_at(&mut self, edge: &Edge, t: f64, line: (f64, f64), points: Points) {
        let outer = edge.square(t);
        let less = edge.square(0.0) - line.0 - line.1 * t;
        let least = less / (outer.sqrt() + (outer - less).max(0.0).sqrt());
        if least <= self.reached * (1.0 + MARGIN) + MARGIN {
            let centre = edge.at(t);
            let width = Extremes::between(points.few, points.sites, centre).width();
            self.offer(width, Place::Centre(centre));
        }
    }
}

/// Far more than the rounding of a width, in coordinates of magnitude one.
const MARGIN: f64 = 1e-9;

/// Distance along an edge, in coordinates of magnitude one, from which rounding hides which of two parallel
/// lines is the lower.
const FAR: f64 = 10.0;

/// Follows the nearest point along the bisector of an edge of the farthest-point diagram, the lower
/// envelope of the lines α + βt, and offers every place of the edge where it changes, and its ends. It
/// begins at the edge's low end or, where that is far away, at the end of the world.
fn walk(edge: &Edge, points: Points, lines: &mut Vec<(f64, f64)>, best: &mut Best) {
    lines.clear();
    lines.extend(points.few.iter().map(|&p| edge.line(p)));
    let begin = if edge.low.abs() < FAR {
        edge.low
    } else {
        f64::NEG_INFINITY
    };
    // The lowest there, of those that meet the one that falls most; at the end of the world the steepest.
    let before = |a: (f64, f64), b: (f64, f64)| {
        if begin.is_finite() {
            let (at_a, at_b) = (a.0 + a.1 * begin, b.0 + b.1 * begin);
            at_a < at_b || at_a == at_b && a.1 < b.1
        } else {
            a.1 > b.1 || a.1 == b.1 && a.0 < b.0
        }
    };
    let first = lines
        .iter()
        .copied()
        .reduce(|least, line| if before(line, least) { line } else { least });
    let Some(first) = first else { return };
    let (mut t, mut nearest) = (begin, first);
    // Each step goes to a line of lesser slope, so that there are at most as many as points.
    loop {
        let (mut crossing, mut line) = (f64::INFINITY, nearest);
        for &other in lines.iter().filter(|other| other.1 < nearest.1) {
            let at = ((other.0 - nearest.0) / (nearest.1 - other.1)).max(t);
            if at < crossing || at == crossing && other.1 < line.1 {
                (crossing, line) = (at, other);
            }
        }
        if line.1 == nearest.1 {
            break;
        }
        if crossing > edge.high {
            break;
        }
        if crossing >= edge.low {
            best.offer_at(edge, crossing, line, points);
        }
        t = crossing;
        nearest = line;
    }
    for end in [edge.low, edge.high] {
        if end.is_finite() {
            best.offer_at(edge, end, nearest, points);
        }
    }
    if edge.low == f64::NEG_INFINITY {
        let back = Point::new(-edge.along.x, -edge.along.y);
        best.offer(0.5 * first.1, Place::Beyond(back));
    }
    if edge.high == f64::INFINITY {
        best.offer(-0.5 * nearest.1, Place::Beyond(edge.along));
    }
}
