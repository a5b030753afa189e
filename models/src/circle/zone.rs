//! Circularity: the radial separation of the points about a reference circle.

use super::farthest::farthest_edges;
use super::inscribed::largest_inscribed;
use super::points::{Circle, CircleError, Frame, Point, check_points};
use serde::{Deserialize, Serialize};

/// Which reference circle (ISO 12181-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reference {
    /// Least squares of the orthogonal distances.
    #[serde(rename = "LSCI")]
    LeastSquares,
    /// The two concentric circles of least separation that hold all points between them.
    #[serde(rename = "MZCI")]
    MinimumZone,
    /// The largest circle without a point inside, held by three points.
    #[serde(rename = "MICI")]
    MaximumInscribed,
    /// The smallest circle around all points.
    #[serde(rename = "MCCI")]
    MinimumCircumscribed,
}

impl Reference {
    /// All four.
    pub const ALL: [Self; 4] = [
        Self::LeastSquares,
        Self::MinimumZone,
        Self::MaximumInscribed,
        Self::MinimumCircumscribed,
    ];

    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LeastSquares => "LSCI",
            Self::MinimumZone => "MZCI",
            Self::MaximumInscribed => "MICI",
            Self::MinimumCircumscribed => "MCCI",
        }
    }
}

/// The points about one centre.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Zone {
    /// Which reference circle gave the centre.
    pub reference: Reference,
    /// Centre of the reference circle, mm.
    pub centre: Point,
    /// Radius of the reference circle, mm; for the minimum zone the mean of its two circles.
    pub radius: f64,
    /// Distance of the nearest point from the centre, mm.
    pub inner: f64,
    /// Distance of the farthest point from the centre, mm.
    pub outer: f64,
    /// Roundness deviation, outer less inner, µm.
    pub width_um: f64,
    /// Points that touch the inner circle, to rounding.
    pub inner_contacts: Vec<usize>,
    /// Points that touch the outer circle, to rounding.
    pub outer_contacts: Vec<usize>,
}

/// The four circularities; a missing one says why.
#[derive(Debug, Clone, PartialEq)]
pub struct Circularity {
    /// About the least-squares centre.
    pub least_squares: Zone,
    /// Minimum zone, exact.
    pub minimum_zone: Result<Zone, CircleError>,
    /// About the maximum inscribed circle.
    pub maximum_inscribed: Result<Zone, CircleError>,
    /// About the minimum circumscribed circle.
    pub minimum_circumscribed: Result<Zone, CircleError>,
}

impl Circularity {
    /// The zones that exist, in the order of [`Reference::ALL`].
    pub fn zones(&self) -> Vec<&Zone> {
        std::iter::once(&self.least_squares)
            .chain(self.minimum_zone.as_ref().ok())
            .chain(self.maximum_inscribed.as_ref().ok())
            .chain(self.minimum_circumscribed.as_ref().ok())
            .collect()
    }
}

/// All four circularities of `points` (mm) about a least-squares circle found before.
///
/// # Errors
/// Those of [`check_points`].
pub fn circularity(points: &[Point], least_squares: Circle) -> Result<Circularity, CircleError> {
    check_points(points)?;
    Ok(Circularity {
        least_squares: zone_about(
            points,
            Reference::LeastSquares,
            least_squares.centre,
            Some(least_squares.radius),
        ),
        minimum_zone: reference_zone(points, Reference::MinimumZone),
        maximum_inscribed: reference_zone(points, Reference::MaximumInscribed),
        minimum_circumscribed: reference_zone(points, Reference::MinimumCircumscribed),
    })
}

/// The zone of one reference circle, found exactly: each optimum is a corner of a finite set, which
/// is searched whole. For the least-squares reference give the fitted circle to [`circularity`];
/// here it stands for the Taubin fit.
///
/// # Errors
/// Those of [`check_points`]; [`CircleError::StraighterThanAnyCircle`] where the minimum zone is a
/// straight strip, [`CircleError::NotSurrounded`] where no inscribed circle is held.
pub fn reference_zone(points: &[Point], reference: Reference) -> Result<Zone, CircleError> {
    check_points(points)?;
    let frame = Frame::of(points);
    let local: Vec<Point> = points.iter().map(|&p| frame.to_local(p)).collect();
    let (centre, radius) = match reference {
        Reference::LeastSquares => {
            let circle = super::algebraic(points, super::AlgebraicFit::Taubin)?;
            return Ok(zone_about(
                points,
                reference,
                circle.centre,
                Some(circle.radius),
            ));
        }
        Reference::MinimumZone => (minimum_zone_centre(&local)?, None),
        Reference::MaximumInscribed => {
            let (c, r) = largest_inscribed(&local).ok_or(CircleError::NotSurrounded)?;
            (c, Some(r))
        }
        Reference::MinimumCircumscribed => farthest_edges(&local)
            .iter()
            .map(|edge| edge.smallest())
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(c, r)| (c, Some(r)))
            .ok_or(CircleError::Collinear)?,
    };
    let world = frame.to_world(Circle {
        centre,
        radius: radius.unwrap_or(1.0),
    });
    Ok(zone_about(
        points,
        reference,
        world.centre,
        radius.map(|_| world.radius),
    ))
}

/// The minimum of (farthest − nearest distance) over all centres.
///
/// At a minimum two outer and two inner contacts alternate: the gradient of an outer distance is a
/// unit vector, and the hulls of the outer and of the inner unit vectors must meet, which on a circle
/// needs two chords that cross. Such a centre lies where an edge of the farthest-point Voronoi diagram
/// crosses one of the nearest-point diagram, so that walking all edges of the first finds it.
fn minimum_zone_centre(points: &[Point]) -> Result<Point, CircleError> {
    let mut best: Option<(Point, f64)> = None;
    let mut strip = f64::INFINITY;
    for edge in farthest_edges(points) {
        let narrowest = edge.zone_candidates(points, |centre| {
            let (inner, outer) = extremes(points, centre);
            let width = outer - inner;
            if best.is_none_or(|(_, w)| width < w) {
                best = Some((centre, width));
            }
        });
        strip = strip.min(narrowest);
    }
    match best {
        Some((centre, width)) if width < strip => Ok(centre),
        _ => Err(CircleError::StraighterThanAnyCircle),
    }
}

fn extremes(points: &[Point], centre: Point) -> (f64, f64) {
    let (low, high) = points.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), p| {
        let q = p.minus(centre);
        let square = q.dot(q);
        (l.min(square), h.max(square))
    });
    (low.sqrt(), high.sqrt())
}

fn zone_about(points: &[Point], reference: Reference, centre: Point, radius: Option<f64>) -> Zone {
    let distances: Vec<f64> = points.iter().map(|p| p.distance(centre)).collect();
    let (inner, outer) = distances
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(l, h), &d| (l.min(d), h.max(d)));
    let magnitude = points
        .iter()
        .fold(outer, |m, p| m.max(p.x.abs()).max(p.y.abs()));
    let touching = |radius: f64| {
        let slack = 64.0 * f64::EPSILON * magnitude;
        (0..points.len())
            .filter(|&i| (distances[i] - radius).abs() <= slack)
            .collect()
    };
    Zone {
        reference,
        centre,
        radius: radius.unwrap_or(0.5 * (inner + outer)),
        inner,
        outer,
        width_um: 1e3 * (outer - inner),
        inner_contacts: touching(inner),
        outer_contacts: touching(outer),
    }
}
