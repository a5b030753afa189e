//! The corner of the L-curve, and whether there is one.

use super::search::{lowest, sample};
use super::{Family, Point, RegularizationError};

/// What the L-curve looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CornerStatus {
    /// One corner.
    Corner,
    /// The curve is concave, or bends too little anywhere to be called an L.
    NoCorner,
    /// The curve bends most where the sampled range of λ ends: the corner lies beyond, if anywhere.
    AtEdge,
    /// More than one bend of like size. The most regularized is taken, the others are listed.
    MultipleCorners,
}

/// One convex bend of the curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// The norms at the greatest curvature.
    pub point: Point,
    /// The greatest curvature, positive.
    pub curvature: f64,
    /// By how much the tangent turns over the whole bend, rad; π/2 for a perfect L.
    pub turn: f64,
}

/// The sampled curve and its corners.
#[derive(Debug, Clone, PartialEq)]
pub struct LCurve {
    /// The curve, ascending in λ.
    pub points: Vec<Point>,
    /// Convex bends, the one to take first; those turning by less than 15° are left out.
    pub corners: Vec<Corner>,
    /// What the curve looks like.
    pub status: CornerStatus,
}

impl LCurve {
    /// λ at the corner; absent when there is none, or when the bend reaches the end of the range.
    pub fn lambda(&self) -> Option<f64> {
        match self.status {
            CornerStatus::Corner | CornerStatus::MultipleCorners => {
                self.corners.first().map(|corner| corner.point.lambda)
            }
            CornerStatus::NoCorner | CornerStatus::AtEdge => None,
        }
    }
}

/// The corner of the L-curve over the family's own range of λ.
///
/// # Errors
/// The family has no range of λ, or failed at some λ.
pub fn l_curve<F: Family + ?Sized>(family: &F) -> Result<LCurve, RegularizationError> {
    let (smallest, largest) = family.range();
    l_curve_between(family, smallest, largest, family.samples())
}

/// The corner of the L-curve sampled at `count` λ from `smallest` to `largest`.
///
/// The tangent's angle is known exactly at each λ, so the curve is cut into arcs over which it
/// turns one way. The arc with the largest turn is the L, and the corner is the greatest analytic
/// curvature on it. A small but sharp kink, which a plain maximum of the curvature falls for, turns
/// the tangent by little.
///
/// # Errors
/// The range is empty, or the family failed at some λ.
pub fn l_curve_between<F: Family + ?Sized>(
    family: &F,
    smallest: f64,
    largest: f64,
    count: usize,
) -> Result<LCurve, RegularizationError> {
    let points = sample(family, smallest, largest, count)?;
    let mut corners = Vec::new();
    let mut touches_edge = Vec::new();
    for (first, last) in convex_arcs(&points) {
        let turn = points[first].tangent_angle() - points[last].tangent_angle();
        let Some(best) = (first..=last)
            .filter(|index| points[*index].curvature().is_finite())
            .max_by(|a, b| points[*a].curvature().total_cmp(&points[*b].curvature()))
        else {
            continue;
        };
        let inside = best > 0 && best + 1 < points.len();
        // Of a bend cut off by the end of the range only a part of the turn is seen.
        if turn
            < if inside {
                SMALLEST_TURN
            } else {
                SMALLEST_CUT_TURN
            }
        {
            continue;
        }
        let point = if inside {
            lowest(
                family,
                points[best - 1].lambda,
                points[best + 1].lambda,
                |point| -point.curvature(),
            )?
        } else {
            points[best]
        };
        touches_edge.push(!inside);
        corners.push(Corner {
            point,
            curvature: point.curvature(),
            turn,
        });
    }
    let largest_turn = corners.iter().map(|corner| corner.turn).fold(0.0, f64::max);
    let is_rival = |corner: &Corner| corner.turn > RIVAL_SHARE * largest_turn;
    // Rivals first, and of them the most regularized: what follows may be noise already.
    let mut order: Vec<usize> = (0..corners.len()).collect();
    order.sort_by(|a, b| {
        let (a, b) = (&corners[*a], &corners[*b]);
        is_rival(b)
            .cmp(&is_rival(a))
            .then(b.point.lambda.total_cmp(&a.point.lambda))
    });
    let rivals = corners.iter().filter(|corner| is_rival(corner)).count();
    let status = match order.first() {
        None => CornerStatus::NoCorner,
        Some(best) if touches_edge[*best] => CornerStatus::AtEdge,
        Some(_) if rivals > 1 => CornerStatus::MultipleCorners,
        Some(_) => CornerStatus::Corner,
    };
    Ok(LCurve {
        corners: order.into_iter().map(|index| corners[index]).collect(),
        points,
        status,
    })
}

/// Index ranges (first, last) over which the tangent grows steeper as λ falls.
fn convex_arcs(points: &[Point]) -> Vec<(usize, usize)> {
    let mut arcs = Vec::new();
    let mut start = 0;
    for index in 1..=points.len() {
        let goes_on = index < points.len()
            && points[index].tangent_angle() < points[index - 1].tangent_angle();
        if !goes_on {
            if index - 1 > start {
                arcs.push((start, index - 1));
            }
            start = index;
        }
    }
    arcs
}

/// 15°: an L turns by 90°, a straight line in log–log scale by nothing.
const SMALLEST_TURN: f64 = 0.261_799_387_799_149_4;

/// 2°, for a bend that the range cuts off where it bends most.
const SMALLEST_CUT_TURN: f64 = 0.034_906_585_039_886_6;

/// A second bend of at least this share of the first one's turn is a rival, not a kink.
const RIVAL_SHARE: f64 = 0.6;
