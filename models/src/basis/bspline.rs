//! Cubic B-splines on any sequence of break points.
//!
//! Source: C. de Boor, *A Practical Guide to Splines*, Springer 1978, chapter IX (recurrence) with
//! the first and last knots fourfold, so that the first and last coefficients are the values at
//! the ends. Within a cell every basis function is stored as a polynomial in t = (x − left)/width:
//! a run of positions in one cell is evaluated without a search.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Why break points cannot carry a spline.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum BreakError {
    /// Fewer than two break points.
    #[error("a spline needs at least two break points, here are {0}")]
    TooFew(usize),
    /// Not finite or not increasing.
    #[error("break points must be finite and increase: {left} mm is followed by {right} mm")]
    NotIncreasing {
        /// The point before, mm.
        left: f64,
        /// The point after, mm.
        right: f64,
    },
}

/// A polynomial of a cell in t, lowest power first.
pub type Cubic = [f64; 4];

/// The basis: break points and, cell by cell, four polynomials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CubicBSpline {
    breaks: Vec<f64>,
    cells: Vec<[Cubic; 4]>,
}

impl CubicBSpline {
    /// A basis on break points, mm.
    ///
    /// # Errors
    /// [`BreakError`] unless there are two or more finite points that increase.
    pub fn new(breaks: Vec<f64>) -> Result<Self, BreakError> {
        if breaks.len() < 2 {
            return Err(BreakError::TooFew(breaks.len()));
        }
        for pair in breaks.windows(2) {
            if !(pair[0] < pair[1]) || !(pair[1] - pair[0]).is_finite() {
                return Err(BreakError::NotIncreasing {
                    left: pair[0],
                    right: pair[1],
                });
            }
        }
        let cells = (0..breaks.len() - 1)
            .map(|k| cell_polynomials(&breaks, k))
            .collect();
        Ok(Self { breaks, cells })
    }

    /// A basis of equal cells over lower..upper, mm.
    ///
    /// # Errors
    /// [`BreakError`] unless lower < upper and there is at least one cell.
    pub fn uniform(lower: f64, upper: f64, cells: usize) -> Result<Self, BreakError> {
        let at = |k: usize| lower + (upper - lower) * (k as f64 / cells as f64);
        Self::new(
            (0..=cells)
                .map(|k| if k == cells { upper } else { at(k) })
                .collect(),
        )
    }

    /// The break points, mm.
    pub fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// Number of basis functions: three more than cells.
    pub fn coefficient_count(&self) -> usize {
        self.cells.len() + 3
    }

    /// The cell of a position; the first or last cell for positions outside.
    pub fn cell_of(&self, x: f64) -> usize {
        let after = self.breaks.partition_point(|b| *b <= x);
        after.clamp(1, self.cells.len()) - 1
    }

    /// The same, sought first in the cell of a position nearby.
    pub fn cell_near(&self, x: f64, near: usize) -> usize {
        match self.breaks.get(near..near + 2) {
            Some([left, right]) if *left <= x && x < *right => near,
            _ => self.cell_of(x),
        }
    }

    /// Left end and width of a cell, mm.
    pub fn cell(&self, k: usize) -> (f64, f64) {
        (self.breaks[k], self.breaks[k + 1] - self.breaks[k])
    }

    /// The polynomials of the four functions that are not zero in cell k: functions k to k+3.
    pub fn polynomials(&self, k: usize) -> &[Cubic; 4] {
        &self.cells[k]
    }

    /// The polynomial of the spline with these coefficients in cell k.
    pub fn cubic(&self, coefficients: &[f64], k: usize) -> Cubic {
        let mut cubic = [0.0; 4];
        for (c, polynomial) in coefficients[k..k + 4].iter().zip(&self.cells[k]) {
            for (sum, p) in cubic.iter_mut().zip(polynomial) {
                *sum += c * p;
            }
        }
        cubic
    }

    /// The first of the four functions not zero at x, and their values.
    pub fn values(&self, x: f64) -> (usize, [f64; 4]) {
        let k = self.cell_of(x);
        let (left, width) = self.cell(k);
        let t = (x - left) / width;
        (k, self.cells[k].map(|p| horner(&p, t)))
    }

    /// Value and slope (per mm) of the spline with these coefficients; beyond the ends the
    /// polynomial of the end cell is continued.
    pub fn evaluate(&self, coefficients: &[f64], x: f64) -> (f64, f64) {
        let k = self.cell_of(x);
        let (left, width) = self.cell(k);
        let t = (x - left) / width;
        let cubic = self.cubic(coefficients, k);
        (horner(&cubic, t), horner_slope(&cubic, t) / width)
    }

    /// The coefficients of a straight line a + d·x: its values at the Greville abscissae.
    pub fn line(&self, a: f64, d: f64) -> Vec<f64> {
        let last = self.breaks.len() - 1;
        let knot = |i: isize| self.breaks[i.clamp(0, last as isize) as usize];
        (0..self.coefficient_count() as isize)
            .map(|j| a + d * (knot(j - 2) + knot(j - 1) + knot(j)) / 3.0)
            .collect()
    }
}

/// The value of a polynomial.
#[inline(always)]
pub fn horner(p: &Cubic, t: f64) -> f64 {
    ((p[3] * t + p[2]) * t + p[1]) * t + p[0]
}

/// The derivative of a polynomial by t.
#[inline(always)]
pub fn horner_slope(p: &Cubic, t: f64) -> f64 {
    (3.0 * p[3] * t + 2.0 * p[2]) * t + p[1]
}

/// The recurrence of de Boor, carried out on polynomials in t instead of on numbers.
fn cell_polynomials(breaks: &[f64], cell: usize) -> [Cubic; 4] {
    let last = breaks.len() as isize - 1;
    let (left, width) = (breaks[cell], breaks[cell + 1] - breaks[cell]);
    // Knot j of the clamped sequence, counted so that the cell lies between knots 0 and 1.
    let knot = |j: isize| breaks[(cell as isize + j).clamp(0, last) as usize];
    let mut functions = [[0.0; 4]; 4];
    functions[0][0] = 1.0;
    for degree in 1..=3_isize {
        let mut next = [[0.0; 4]; 4];
        // At this degree function r spans the knots r − degree to r + 1.
        for r in 0..degree {
            let (from, to) = (knot(r - degree + 1), knot(r + 1));
            let share = [(left - from) / (to - from), width / (to - from)];
            let lower = functions[r as usize];
            for power in 0..degree as usize {
                let value = lower[power];
                // (x − from)/(to − from) of it goes to the function on the right, the rest left.
                next[r as usize + 1][power] += share[0] * value;
                next[r as usize + 1][power + 1] += share[1] * value;
                next[r as usize][power] += (1.0 - share[0]) * value;
                next[r as usize][power + 1] -= share[1] * value;
            }
        }
        functions = next;
    }
    functions
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uneven() -> CubicBSpline {
        CubicBSpline::new(vec![0.0, 1.0, 1.5, 4.0, 4.25, 9.0]).unwrap()
    }

    #[test]
    fn functions_sum_to_one_and_join_with_two_derivatives() {
        let basis = uneven();
        for k in 0..basis.cell_count() {
            for t in [0.0, 0.3, 1.0] {
                let sum: f64 = basis.polynomials(k).iter().map(|p| horner(p, t)).sum();
                // Epsilons: four terms of at most one.
                assert!(
                    (sum - 1.0).abs() < 8.0 * f64::EPSILON,
                    "cell {k}, t {t}: {sum}"
                );
            }
        }
        for k in 0..basis.cell_count() - 1 {
            let (_, h) = basis.cell(k);
            let (_, next_h) = basis.cell(k + 1);
            for j in 0..3 {
                let (p, q) = (basis.polynomials(k)[j + 1], basis.polynomials(k + 1)[j]);
                let bend = |p: &Cubic, t: f64, h: f64| (6.0 * p[3] * t + 2.0 * p[2]) / (h * h);
                // Epsilons: second differences of values of order one over cells of order one.
                assert!((horner(&p, 1.0) - horner(&q, 0.0)).abs() < 1e-14);
                assert!((horner_slope(&p, 1.0) / h - horner_slope(&q, 0.0) / next_h).abs() < 1e-13);
                assert!((bend(&p, 1.0, h) - bend(&q, 0.0, next_h)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_cubic_and_a_line_are_reproduced() {
        let basis = uneven();
        let line = basis.line(2.0, -0.5);
        for x in [0.0, 0.7, 3.99, 9.0, 9.5] {
            let (value, slope) = basis.evaluate(&line, x);
            // Epsilons: values below ten.
            assert!((value - (2.0 - 0.5 * x)).abs() < 1e-13, "at {x}: {value}");
            assert!((slope + 0.5).abs() < 1e-13, "at {x}: {slope}");
        }
    }

    #[test]
    fn break_points_are_checked() {
        assert_eq!(CubicBSpline::new(vec![1.0]), Err(BreakError::TooFew(1)));
        assert!(CubicBSpline::new(vec![0.0, 0.0]).is_err());
        assert!(CubicBSpline::new(vec![0.0, f64::NAN]).is_err());
        assert!(CubicBSpline::uniform(0.0, 1.0, 0).is_err());
    }
}
