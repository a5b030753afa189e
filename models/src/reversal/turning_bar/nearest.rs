//! The spline in time that follows samples of a turn.

use crate::basis::bspline::CubicBSpline;

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

/// Coefficients of the spline in time that comes nearest to samples, rad.
pub fn turn_near(basis: &CubicBSpline, samples: &[TurnSample]) -> Option<Vec<f64>> {
    let n = basis.coefficient_count();
    // Of each coefficient the elements with itself and the three after it.
    let mut normal = vec![[0.0; 4]; n];
    let mut turn = vec![0.0; n];
    for sample in samples {
        let (first, values) = basis.values(sample.time);
        for (i, a) in values.iter().enumerate() {
            turn[first + i] += sample.weight * a * sample.stray;
            for (j, b) in values[i..].iter().enumerate() {
                normal[first + i][j] += sample.weight * b * a;
            }
        }
    }
    // Where a cell has no sample the curve goes on as it was.
    let stiff = 1e-6 / n as f64;
    let bend = [1.0, -2.0, 1.0];
    for k in 0..n.saturating_sub(2) {
        for (i, a) in bend.into_iter().enumerate() {
            for (j, b) in bend[i..].iter().enumerate() {
                normal[k + i][j] += stiff * a * b;
            }
        }
    }
    solve_banded(normal, &mut turn)?;
    Some(turn)
}

/// Solves a positive definite system of which each unknown is beside the three after it, by Cholesky; `None` of
/// another.
fn solve_banded(mut matrix: Vec<[f64; 4]>, x: &mut [f64]) -> Option<()> {
    let n = matrix.len();
    for j in 0..n {
        for k in j.saturating_sub(3)..j {
            let above = matrix[k];
            for (value, other) in matrix[j].iter_mut().zip(&above[j - k..]) {
                *value -= above[j - k] * other;
            }
        }
        if !(matrix[j][0] > 0.0) {
            return None;
        }
        matrix[j][0] = matrix[j][0].sqrt();
        let (diagonal, after) = matrix[j].split_at_mut(1);
        after.iter_mut().for_each(|value| *value /= diagonal[0]);
    }
    for i in 0..n {
        x[i] /= matrix[i][0];
        for k in 1..4.min(n - i) {
            x[i + k] -= matrix[i][k] * x[i];
        }
    }
    for i in (0..n).rev() {
        let after: f64 = (1..4.min(n - i)).map(|k| matrix[i][k] * x[i + k]).sum();
        x[i] = (x[i] - after) / matrix[i][0];
    }
    Some(())
}
