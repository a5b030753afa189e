//! Generalized cross-validation.

use super::search::{lowest, sample};
use super::{Family, Point, RegularizationError};

/// The minimum of the GCV function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gcv {
    /// The norms at the minimum.
    pub point: Point,
    /// ‖Ax − b‖² / (m − effective parameters)² there.
    pub value: f64,
    /// The minimum lies at an end of the range: the data want less or more smoothing than the range
    /// holds, and `point` is that end.
    pub at_edge: bool,
}

/// λ that minimises ‖Ax − b‖² / (m − trace)² (Golub, Heath and Wahba 1979).
///
/// Assumes white noise; correlated noise is taken for signal and the choice is far too small.
///
/// # Errors
/// No range of λ, or the family failed at some λ.
pub fn gcv<F: Family + ?Sized>(family: &F) -> Result<Gcv, RegularizationError> {
    let (smallest, largest) = family.range();
    gcv_among(
        family,
        &sample(family, smallest, largest, family.samples())?,
    )
}

/// As [`gcv`], beginning from norms that are known already, ascending in λ.
///
/// # Errors
/// No points, or the family failed at some λ.
pub fn gcv_among<F: Family + ?Sized>(
    family: &F,
    points: &[Point],
) -> Result<Gcv, RegularizationError> {
    if points.is_empty() {
        return Err(RegularizationError::NothingToChoose);
    }
    let rows = family.row_count();
    let value = |point: &Point| {
        let left = point.residual_degrees_of_freedom(rows);
        if left > 0.0 {
            (point.residual_norm / left).powi(2)
        } else {
            f64::INFINITY
        }
    };
    let values: Vec<f64> = points.iter().map(value).collect();
    let last = values.len() - 1;
    // A minimum at the small end is the 0/0 of a solution that fits all the noise, and so may be
    // one inside: any inner one is preferred to the end, and of several alike the most regularized.
    let inner: Vec<usize> = (1..last)
        .filter(|index| values[*index] <= values[index - 1] && values[*index] < values[index + 1])
        .collect();
    let least = inner
        .iter()
        .map(|index| values[*index])
        .fold(f64::INFINITY, f64::min);
    let alike = inner
        .iter()
        .rposition(|index| values[*index] <= ALIKE * least)
        .map(|place| inner[place]);
    let best = match alike {
        Some(index) if values[index] <= values[last] => index,
        _ if values[0] < values[last] => 0,
        _ => last,
    };
    let at_edge = best == 0 || best == last;
    let point = if at_edge {
        points[best]
    } else {
        lowest(
            family,
            points[best - 1].lambda,
            points[best + 1].lambda,
            value,
        )?
    };
    Ok(Gcv {
        point,
        value: value(&point),
        at_edge,
    })
}

/// Two minima whose values differ by less than this factor are alike: the value is a variance with
/// the uncertainty of one.
const ALIKE: f64 = 2.0;
