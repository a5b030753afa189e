//! Points in the plane, circles, and what can be wrong with the points.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A measured point, mm.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Point {
    /// First coordinate, mm.
    pub x: f64,
    /// Second coordinate, mm.
    pub y: f64,
}

impl Point {
    /// A point from its coordinates in mm.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Distance to another point, mm.
    pub fn distance(self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }

    pub(super) fn minus(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }

    pub(super) fn plus(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }

    pub(super) fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    pub(super) fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }
}

/// A circle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Circle {
    /// Centre, mm.
    pub centre: Point,
    /// Radius, mm.
    pub radius: f64,
}

/// Where a fit stood that ended without a minimum: no estimate, for which there is no uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachedCircle {
    /// The circle of the last step.
    pub circle: Circle,
    /// Root mean square of the radial deviations from it, µm.
    pub residual_rms_um: f64,
    /// Iterations made.
    pub iterations: u64,
}

/// Why no circle can be given.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CircleError {
    /// Passes with different numbers of points cannot be compared place by place.
    #[error(
        "the first repeat has {first} points, another has {other}: give every repeat the same points"
    )]
    RepeatsDiffer {
        /// Points of the first repeat.
        first: usize,
        /// Points of the other.
        other: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {} is not finite: remove or correct it", index + 1)]
    NotFinite {
        /// Place in the list of points, from 0.
        index: usize,
    },
    /// A coordinate so large that squares of lengths overflow.
    #[error(
        "point {} has the coordinate {value:e} mm, more than the {LARGEST:e} mm that can be calculated with",
        index + 1
    )]
    TooLarge {
        /// Place in the list of points, from 0.
        index: usize,
        /// The coordinate, mm.
        value: f64,
    },
    /// Points so close together that squares of their distances vanish.
    #[error(
        "the points lie within {spread:e} mm of each other, less than the {SMALLEST:e} mm that can be calculated with"
    )]
    TooClose {
        /// Greatest coordinate difference from the first point, mm.
        spread: f64,
    },
    /// Fewer than three points that differ.
    #[error(
        "a circle needs three different points, these are {distinct} different among {count}: measure more points"
    )]
    TooFewPoints {
        /// Points given.
        count: usize,
        /// Points that differ.
        distinct: usize,
    },
    /// All points are the same point.
    #[error(
        "all {count} points are the same point, a circle of radius zero: check the columns that were read"
    )]
    AllEqual {
        /// Points given.
        count: usize,
    },
    /// The points lie on a straight line to within their rounding.
    #[error("the points lie on a straight line: no circle passes through them")]
    Collinear,
    /// A straight line fits better than any circle.
    #[error(
        "a straight line fits the points at least as well as any circle: the arc is too short for its noise"
    )]
    StraighterThanAnyCircle,
    /// A start or a simulation with radius zero or less.
    #[error("the radius must be greater than zero, it is {radius} mm")]
    RadiusNotPositive {
        /// The radius given, mm.
        radius: f64,
    },
    /// The points do not surround a centre, so that they hold neither an inscribed nor a circumscribed
    /// circle.
    #[error(
        "the points cover too short an arc: they do not surround the centre, so that they hold no circle on all sides"
    )]
    NotSurrounded,
    /// Three points leave nothing to estimate the noise from.
    #[error(
        "three points fit any circle exactly: measure more of them, or give the noise of a point"
    )]
    NoRedundancy,
    /// Figures of a simulation that are not finite.
    #[error("the {what} of the simulation must be finite")]
    SimulationNotFinite {
        /// Which.
        what: &'static str,
    },
    /// The iteration did not reach a minimum.
    #[error("the orthogonal fit did not converge: {reason}")]
    NotConverged {
        /// The solver's own words.
        reason: String,
        /// How far it got, if it made a step.
        reached: Option<ReachedCircle>,
    },
}

/// Greatest coordinate, mm, whose square, and the square of that in µm, stay far from overflow.
pub const LARGEST: f64 = 1e100;

/// Least extent of a set of points, mm, whose square stays far from underflow.
pub const SMALLEST: f64 = 1e-100;

/// Refuses points through which no circle can be laid.
///
/// # Errors
/// [`CircleError::NotFinite`], [`CircleError::TooLarge`], [`CircleError::TooFewPoints`],
/// [`CircleError::AllEqual`], [`CircleError::TooClose`], [`CircleError::Collinear`].
pub fn check_points(points: &[Point]) -> Result<(), CircleError> {
    if let Some(index) = points
        .iter()
        .position(|p| !(p.x.is_finite() && p.y.is_finite()))
    {
        return Err(CircleError::NotFinite { index });
    }
    for (index, p) in points.iter().enumerate() {
        for value in [p.x, p.y] {
            if value.abs() > LARGEST {
                return Err(CircleError::TooLarge { index, value });
            }
        }
    }
    let count = points.len();
    match distinct_up_to_three(points) {
        1 if count > 1 => return Err(CircleError::AllEqual { count }),
        distinct @ 0..=2 => return Err(CircleError::TooFewPoints { count, distinct }),
        _ => {}
    }
    let spread = points.iter().fold(0.0_f64, |widest, p| {
        let q = p.minus(points[0]);
        widest.max(q.x.abs()).max(q.y.abs())
    });
    if spread < SMALLEST {
        return Err(CircleError::TooClose { spread });
    }
    // The spread across the best line is the smaller semi-axis of the scatter; it is rounding when
    // it is of the order of the coordinates' last digit.
    let frame = Frame::of(points);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    let mut greatest: f64 = 0.0;
    for p in points {
        let q = frame.to_local(*p);
        xx += q.x * q.x;
        xy += q.x * q.y;
        yy += q.y * q.y;
        greatest = greatest.max(p.x.abs()).max(p.y.abs());
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let normal = Point::new(-angle.sin(), angle.cos());
    let across = points
        .iter()
        .map(|p| frame.to_local(*p).dot(normal).abs())
        .fold(0.0, f64::max);
    let rounding = 8.0 * f64::EPSILON * (1.0 + greatest / frame.scale);
    if across <= rounding {
        return Err(CircleError::Collinear);
    }
    Ok(())
}

/// How many of the points differ, three standing for more.
fn distinct_up_to_three(points: &[Point]) -> usize {
    let Some(&first) = points.first() else {
        return 0;
    };
    let Some(&second) = points.iter().find(|&&p| p != first) else {
        return 1;
    };
    if points.iter().any(|&p| p != first && p != second) {
        3
    } else {
        2
    }
}

/// Radius, in root-mean-square distances from the centroid, beyond which the arc is a line to rounding:
/// its sagitta is then below 1e-8 of its length.
pub(super) const FLAT: f64 = 1e8;

/// Centroid and root-mean-square distance: coordinates in which the fits are well scaled.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) centroid: Point,
    pub(super) scale: f64,
}

impl Frame {
    pub(super) fn of(points: &[Point]) -> Self {
        let n = points.len().max(1) as f64;
        // The first point is taken off before averaging, so that a far origin costs no digits.
        let first = points.first().copied().unwrap_or_default();
        let sum = points
            .iter()
            .fold(Point::default(), |s, p| s.plus(p.minus(first)));
        let centroid = first.plus(Point::new(sum.x / n, sum.y / n));
        let square: f64 = points
            .iter()
            .map(|p| {
                let q = p.minus(centroid);
                q.dot(q)
            })
            .sum();
        let scale = (square / n).sqrt();
        Self {
            centroid,
            scale: if scale > 0.0 { scale } else { 1.0 },
        }
    }

    pub(super) fn to_local(self, p: Point) -> Point {
        let q = p.minus(self.centroid);
        Point::new(q.x / self.scale, q.y / self.scale)
    }

    pub(super) fn to_world(self, c: Circle) -> Circle {
        Circle {
            centre: self
                .centroid
                .plus(Point::new(c.centre.x * self.scale, c.centre.y * self.scale)),
            radius: c.radius * self.scale,
        }
    }
}

/// The centre of the circle through three points, or nothing when they are on a line.
pub(super) fn circumcentre(a: Point, b: Point, c: Point) -> Option<Point> {
    let (u, v) = (b.minus(a), c.minus(a));
    let twice_area = 2.0 * u.cross(v);
    if twice_area == 0.0 {
        return None;
    }
    let (uu, vv) = (u.dot(u), v.dot(v));
    let centre = a.plus(Point::new(
        (v.y * uu - u.y * vv) / twice_area,
        (u.x * vv - v.x * uu) / twice_area,
    ));
    (centre.x.is_finite() && centre.y.is_finite()).then_some(centre)
}
