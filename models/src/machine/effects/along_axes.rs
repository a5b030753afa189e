//! Positions scaled to a part: what bends of an axis are functions of.

use super::MeasuredParts;
use crate::machine::{Axis, Position};

/// Orders of a bend, by their names.
pub(super) const ORDERS: [(&str, usize); 2] = [("second order", 2), ("third order", 3)];

/// The Legendre polynomial of second or third order over the range of the positions along an axis: no mean
/// and no slope over it, 1 at its end. `None` where fewer than `order + 1` positions tell it.
pub(super) fn bend(
    model: &MeasuredParts,
    along: Axis,
    order: usize,
) -> Option<impl Fn(&Position) -> f64 + use<>> {
    let mut positions: Vec<f64> = model
        .readings()
        .iter()
        .map(|r| r.position[along.index()])
        .collect();
    positions.sort_by(f64::total_cmp);
    let (first, last) = (*positions.first()?, *positions.last()?);
    positions.dedup_by(|b, a| (*b - *a).abs() <= 1e-9 * (last - first));
    if positions.len() <= order || last <= first {
        return None;
    }
    let (middle, half) = ((first + last) / 2.0, (last - first) / 2.0);
    Some(move |position: &Position| {
        let u = (position[along.index()] - middle) / half;
        match order {
            2 => (3.0 * u * u - 1.0) / 2.0,
            _ => (5.0 * u.powi(3) - 3.0 * u) / 2.0,
        }
    })
}

/// Whether any reading is along this axis.
pub(super) fn is_read(model: &MeasuredParts, axis: Axis) -> bool {
    model.readings().iter().any(|r| r.axis == axis)
}
