//! Circularity: the radial separation of the points about a reference circle.

use super::circumscribed::smallest_circumscribed;
use super::contacts::{First, all_on_one_side};
use super::inscribed::largest_inscribed;
use super::minimum_zone::minimum_zone_centre;
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
    let search = Search::new(points, least_squares.centre);
    let maximum_inscribed = search.maximum_inscribed();
    Ok(Circularity {
        least_squares: zone_about(
            points,
            Reference::LeastSquares,
            least_squares.centre,
            Some(least_squares.radius),
        ),
        minimum_zone: search.minimum_zone(),
        minimum_circumscribed: match &maximum_inscribed {
            Ok(_) => search.minimum_circumscribed(),
            Err(reason) => Err(reason.clone()),
        },
        maximum_inscribed,
    })
}

/// The zone of one reference circle, exact to the rounding of the coordinates. For the least-squares
/// reference give the fitted circle to [`circularity`]; here it stands for the Taubin fit.
///
/// # Errors
/// Those of [`check_points`]; [`CircleError::StraighterThanAnyCircle`] where the minimum zone is a
/// straight strip; for the inscribed and the circumscribed circle [`CircleError::NotSurrounded`] where
/// the points do not surround the least-squares centre or hold no inscribed circle.
pub fn reference_zone(points: &[Point], reference: Reference) -> Result<Zone, CircleError> {
    check_points(points)?;
    let taubin = super::algebraic(points, super::AlgebraicFit::Taubin);
    if reference == Reference::LeastSquares {
        let circle = taubin?;
        return Ok(zone_about(
            points,
            reference,
            circle.centre,
            Some(circle.radius),
        ));
    }
    // Without a circle the centre counts as far away, where no points surround it.
    let centre = taubin.map_or(Point::new(f64::INFINITY, 0.0), |c| c.centre);
    let search = Search::new(points, centre);
    match reference {
        Reference::MinimumZone => search.minimum_zone(),
        Reference::MaximumInscribed => search.maximum_inscribed(),
        _ => search
            .maximum_inscribed()
            .and_then(|_| search.minimum_circumscribed()),
    }
}

/// The points in coordinates of magnitude one and where to begin.
struct Search<'a> {
    points: &'a [Point],
    frame: Frame,
    local: Vec<Point>,
    start: Point,
    first: First,
    surrounded: bool,
}

impl<'a> Search<'a> {
    fn new(points: &'a [Point], centre: Point) -> Self {
        let frame = Frame::of(points);
        let local: Vec<Point> = points.iter().map(|&p| frame.to_local(p)).collect();
        let centre = frame.to_local(centre);
        let near = centre.x.abs().max(centre.y.abs()) < FAR;
        let start = if near { centre } else { Point::default() };
        Self {
            points,
            frame,
            surrounded: near && all_on_one_side(&local, centre).is_none(),
            start,
            first: First::about(&local, start),
            local,
        }
    }

    fn zone(&self, reference: Reference, centre: Point, radius: Option<f64>) -> Zone {
        let world = self.frame.to_world(Circle {
            centre,
            radius: radius.unwrap_or(1.0),
        });
        zone_about(
            self.points,
            reference,
            world.centre,
            radius.map(|_| world.radius),
        )
    }

    fn minimum_zone(&self) -> Result<Zone, CircleError> {
        let centre = minimum_zone_centre(&self.local, self.start, &self.first)?;
        Ok(self.zone(Reference::MinimumZone, centre, None))
    }

    fn maximum_inscribed(&self) -> Result<Zone, CircleError> {
        if !self.surrounded {
            return Err(CircleError::NotSurrounded);
        }
        let (centre, radius) =
            largest_inscribed(&self.local, &self.first).ok_or(CircleError::NotSurrounded)?;
        Ok(self.zone(Reference::MaximumInscribed, centre, Some(radius)))
    }

    fn minimum_circumscribed(&self) -> Result<Zone, CircleError> {
        let (centre, radius) =
            smallest_circumscribed(&self.local, self.first.apart).ok_or(CircleError::Collinear)?;
        Ok(self.zone(Reference::MinimumCircumscribed, centre, Some(radius)))
    }
}

/// Distance of a centre, in root-mean-square distances from the centroid, beyond which a search does
/// not begin there.
const FAR: f64 = 1e6;

fn zone_about(points: &[Point], reference: Reference, centre: Point, radius: Option<f64>) -> Zone {
    // Squares of the coordinates that are let through stay within the range of numbers.
    let distance = |p: &Point| {
        let q = p.minus(centre);
        q.dot(q).sqrt()
    };
    let distances: Vec<f64> = points.iter().map(distance).collect();
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
