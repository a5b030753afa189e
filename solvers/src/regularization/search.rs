//! Searching over ln λ: a grid first, then Brent's search around the best point.

use super::{Family, Point, RegularizationError};
use crate::scalar::{NotFound, least_between, root_between};

/// `count` values from `smallest` to `largest`, evenly spaced in their logarithm, ascending.
pub(super) fn logarithmic_grid(smallest: f64, largest: f64, count: usize) -> Vec<f64> {
    let (low, high) = (smallest.ln(), largest.ln());
    let steps = count.max(2) - 1;
    (0..=steps)
        .map(|step| (low + (high - low) * step as f64 / steps as f64).exp())
        .collect()
}

/// The norms on a grid over the family's own range.
pub(super) fn sample<F: Family + ?Sized>(
    family: &F,
    smallest: f64,
    largest: f64,
    count: usize,
) -> Result<Vec<Point>, RegularizationError> {
    if !(smallest.is_finite() && largest.is_finite() && smallest > 0.0 && smallest < largest) {
        return Err(RegularizationError::NothingToChoose);
    }
    family.points(&logarithmic_grid(smallest, largest, count))
}

/// How closely a λ is found, in ln λ: far finer than any rule means it.
const CLOSE: f64 = 1e-3;

/// The point of the smallest `objective` between two λ.
pub(super) fn lowest<F: Family + ?Sized>(
    family: &F,
    smallest: f64,
    largest: f64,
    objective: impl Fn(&Point) -> f64,
) -> Result<Point, RegularizationError> {
    let found = least_between(smallest.ln(), largest.ln(), CLOSE, |log_lambda| {
        Ok(objective(&family.point(log_lambda.exp())?))
    });
    family.point(found.map_err(as_regularization)?.exp())
}

/// The point between two λ at which `objective`, of different signs at both, is zero; λ to a share
/// `tolerance`.
pub(super) fn root<F: Family + ?Sized>(
    family: &F,
    (smallest, largest): (f64, f64),
    tolerance: f64,
    objective: impl Fn(&Point) -> f64,
) -> Result<Point, RegularizationError> {
    let found = root_between(smallest.ln(), largest.ln(), tolerance, |log_lambda| {
        Ok(objective(&family.point(log_lambda.exp())?))
    });
    family.point(found.map_err(as_regularization)?.exp())
}

fn as_regularization(not: NotFound<RegularizationError>) -> RegularizationError {
    match not {
        NotFound::Function(own) => own,
        NotFound::Bracket(_) => RegularizationError::NothingToChoose,
    }
}
