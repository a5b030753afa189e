//! Searching over log λ: a grid first, then a golden section around the best point.

use super::{Family, Point, RegularizationError};

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

/// The point of the smallest `objective` between two λ, to 1e-3 in log λ: far finer than any rule
/// means its λ.
pub(super) fn golden_section<F: Family + ?Sized>(
    family: &F,
    smallest: f64,
    largest: f64,
    objective: impl Fn(&Point) -> f64,
) -> Result<Point, RegularizationError> {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (smallest.ln(), largest.ln());
    let at = |log_lambda: f64| family.point(log_lambda.exp());
    let mut inner = high - SHARE * (high - low);
    let mut outer = low + SHARE * (high - low);
    let mut inner_point = at(inner)?;
    let mut outer_point = at(outer)?;
    while high - low > 1e-3 {
        if objective(&inner_point) < objective(&outer_point) {
            high = outer;
            (outer, outer_point) = (inner, inner_point);
            inner = high - SHARE * (high - low);
            inner_point = at(inner)?;
        } else {
            low = inner;
            (inner, inner_point) = (outer, outer_point);
            outer = low + SHARE * (high - low);
            outer_point = at(outer)?;
        }
    }
    Ok(if objective(&inner_point) < objective(&outer_point) {
        inner_point
    } else {
        outer_point
    })
}
