//! The spline in time that follows samples of a turn.

use errsep_solvers::linear::banded::{BandTriangle, RowStack};

use crate::basis::bspline::CubicBSpline;

/// Part of its column that is rounding: a coefficient of which no more is left is not determined.
const UNDETERMINED: f64 = 1e-12;

/// How far the turn strays at a time.
#[derive(Debug, Clone, Copy)]
pub struct TurnSample {
    /// s.
    pub time: f64,
    /// rad.
    pub stray: f64,
    /// Its share of the whole.
    pub weight: f64,
}

/// What a coefficient's second difference weighs beside all samples: where a cell has none the curve goes on as it
/// was.
const STIFF: f64 = 1e-6;

/// Coefficients of the spline in time that comes nearest to samples, rad; nothing where they do not determine it.
pub fn turn_near(basis: &CubicBSpline, samples: &[TurnSample]) -> Option<Vec<f64>> {
    let n = basis.coefficient_count();
    // Where a row begins in the band, its four values and what they are to make.
    let mut rows: Vec<(usize, [f64; 4], f64)> = Vec::with_capacity(samples.len() + n);
    for sample in samples {
        let (first, values) = basis.values(sample.time);
        let root = sample.weight.sqrt();
        rows.push((first, values.map(|v| root * v), root * sample.stray));
    }
    let stiff = (STIFF / n as f64).sqrt();
    let bend = [stiff, -2.0 * stiff, stiff, 0.0];
    rows.extend((0..n.saturating_sub(3)).map(|first| (first, bend, 0.0)));
    rows.push((n - 4, [0.0, stiff, -2.0 * stiff, stiff], 0.0));
    rows.sort_by_key(|row| row.0);
    let mut triangle = BandTriangle::new(n, 4, 1);
    let mut stack = RowStack::default();
    for (first, values, made) in rows {
        stack.reset(first, 4, 1, 1);
        let row = stack.row_mut(0);
        row[..4].copy_from_slice(&values);
        row[4] = made;
        triangle.fold(&mut stack);
    }
    if !triangle.undetermined(UNDETERMINED).is_empty() {
        return None;
    }
    let mut turn: Vec<f64> = (0..n).map(|i| triangle.tail_row(i)[0]).collect();
    triangle.solve(&mut turn);
    Some(turn)
}
