//! The largest circle that no point is inside of and that three points hold on all sides.
//!
//! Its centre is a vertex of the nearest-point Voronoi diagram lying within the triangle of its
//! three contacts. Each point's cell is cut out of the bounding box by its bisectors; a cell whose
//! corners are all nearer than the best radius so far cannot hold the centre and is left.

use super::points::{Point, circumcentre};

#[derive(Clone, Copy)]
struct Corner {
    at: Point,
    /// The point whose bisector forms the side from this corner to the next; none for the box.
    side: Option<usize>,
}

/// Centre and radius, or nothing where no three points surround an empty circle.
pub(super) fn largest_inscribed(points: &[Point]) -> Option<(Point, f64)> {
    let (mut low, mut high) = (*points.first()?, *points.first()?);
    for p in points {
        low = Point::new(low.x.min(p.x), low.y.min(p.y));
        high = Point::new(high.x.max(p.x), high.y.max(p.y));
    }
    let mut best: Option<(Point, f64)> = None;
    for i in 0..points.len() {
        let beaten = best.map_or(0.0, |(_, radius)| radius);
        for (a, b) in cell_vertices(points, i, low, high, beaten) {
            let contacts = [points[i], points[a], points[b]];
            let Some(centre) = circumcentre(contacts[0], contacts[1], contacts[2]) else {
                continue;
            };
            let radius = centre.distance(contacts[0]);
            if best.is_none_or(|(_, r)| radius > r) && surrounds(contacts, centre) {
                best = Some((centre, radius));
            }
        }
    }
    best
}

/// Pairs of points that together with point `i` define the corners of its cell farther than `beaten`.
fn cell_vertices(
    points: &[Point],
    i: usize,
    low: Point,
    high: Point,
    beaten: f64,
) -> Vec<(usize, usize)> {
    let own = points[i];
    let corner = |x, y| Corner {
        at: Point::new(x, y),
        side: None,
    };
    let mut cell = vec![
        corner(low.x, low.y),
        corner(high.x, low.y),
        corner(high.x, high.y),
        corner(low.x, high.y),
    ];
    for (j, &other) in points.iter().enumerate() {
        if other == own {
            continue;
        }
        cut(&mut cell, own, other, j);
        if cell.iter().all(|c| c.at.distance(own) < beaten) {
            return Vec::new();
        }
    }
    let mut vertices = Vec::new();
    for (k, here) in cell.iter().enumerate() {
        let before = cell[(k + cell.len() - 1) % cell.len()];
        if let (Some(a), Some(b)) = (before.side, here.side) {
            vertices.push((a, b));
        }
    }
    vertices
}

/// Keeps the part of the cell that is nearer to `own` than to `other`.
fn cut(cell: &mut Vec<Corner>, own: Point, other: Point, index: usize) {
    let normal = other.minus(own);
    let middle = Point::new(0.5 * (own.x + other.x), 0.5 * (own.y + other.y));
    let excess = |p: Point| p.minus(middle).dot(normal);
    if cell.iter().all(|c| excess(c.at) <= 0.0) {
        return;
    }
    let mut kept = Vec::with_capacity(cell.len() + 1);
    for (k, here) in cell.iter().enumerate() {
        let next = cell[(k + 1) % cell.len()];
        let (e, f) = (excess(here.at), excess(next.at));
        let crossing = || {
            let share = e / (e - f);
            here.at.plus(Point::new(
                share * (next.at.x - here.at.x),
                share * (next.at.y - here.at.y),
            ))
        };
        match (e <= 0.0, f <= 0.0) {
            (true, true) => kept.push(*here),
            (true, false) => {
                kept.push(*here);
                kept.push(Corner {
                    at: crossing(),
                    side: Some(index),
                });
            }
            (false, true) => kept.push(Corner {
                at: crossing(),
                side: here.side,
            }),
            (false, false) => {}
        }
    }
    *cell = kept;
}

/// Whether the centre lies within the triangle of its contacts, sides included.
fn surrounds(contacts: [Point; 3], centre: Point) -> bool {
    let [a, b, c] = contacts;
    let turns = [(a, b), (b, c), (c, a)].map(|(p, q)| q.minus(p).cross(centre.minus(p)));
    turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0)
}
