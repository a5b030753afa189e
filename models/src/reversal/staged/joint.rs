//! The lines of all channels, solved together with forms that are free at every position.
//!
//! Reading c at position k is the sum of the forms that channel c sees there and its line T ξ + b. At a
//! position the forms take up as many readings as there are forms; what is left of four readings is the
//! closure. So the forms drop out position by position and the lines alone are left, tied by: the
//! height and slope of every form are zero (the [gauge](LinePart::gauge)), and those of the closure
//! over the positions that all four channels have. That is a linear system of two unknowns a channel
//! for any number of positions. Where every channel has every position on an even grid, its solution
//! is the least-squares line of each channel.
//!
//! Every result is a linear combination of the readings; its uncertainty is the norm of these weights.

use nalgebra::{DMatrix, DVector, SVector};

use super::NoSolution;
use super::designs::Designs;
use super::gauge::LinePart;
use super::grid::Grid;
use super::line::Line;
use super::resample::Stencil;
use super::trace::Trace;

/// As many conditions as unknowns: two for each of at most four channels.
const MOST: usize = 8;

/// What a reading gives to each condition.
type Column = SVector<f64, MOST>;

/// The lines and what their uncertainty is made of.
#[derive(Debug)]
pub struct Joint<'a> {
    grid: &'a Grid,
    /// The line of each trace.
    pub lines: Vec<Line>,
    /// What the lines leave, by trace and position of the grid; zero where a trace has no value.
    pub rests: Vec<Vec<f64>>,
    center: f64,
    scale: f64,
    /// Slopes over half the range, then heights, by condition.
    inverse: DMatrix<f64>,
    /// Products of the conditions over all readings, for noise 1.
    products: DMatrix<f64>,
    /// By trace and point: what it gives to the conditions, over its number of readings.
    columns: Vec<Vec<Column>>,
    /// Readings at each point, by trace.
    counts: Vec<&'a [f64]>,
    /// By trace, its partner: the opposite indicator at the same position of the spindle.
    partners: Vec<Option<Partner>>,
}

/// What a trace shares with its partner.
#[derive(Debug, Clone)]
struct Partner {
    trace: usize,
    /// Correlation of readings.
    correlation: f64,
    /// By point, that of the partner at the same place.
    points: Vec<Option<usize>>,
}

impl<'a> Joint<'a> {
    /// Solves for the lines, from those of each trace by itself.
    ///
    /// # Errors
    /// [`NoSolution::NoOverlap`] where the positions do not determine the lines.
    pub fn solve(
        traces: &'a [Trace],
        first: &[Line],
        grid: &'a Grid,
        designs: &Designs,
        gauge: &LinePart,
    ) -> Result<Self, NoSolution> {
        let n = traces.len();
        let too_few = || NoSolution::NoOverlap {
            positions: grid.x.len(),
        };
        let (Some(low), Some(high)) = (grid.x.first(), grid.x.last()) else {
            return Err(too_few());
        };
        let (center, scale) = (gauge.center, (high - low) / 2.0);
        let closing = LinePart::alike(&grid.x, |k| designs.closing(grid.subsets[k]).is_some());
        let mut matrix = DMatrix::zeros(2 * n, 2 * n);
        let mut right = DVector::zeros(2 * n);
        let mut columns = Vec::with_capacity(n);
        let mut rests = Vec::with_capacity(n);
        for (c, (trace, line)) in traces.iter().zip(first).enumerate() {
            let detrended: Vec<f64> = (trace.x.iter().zip(&trace.mean))
                .map(|(x, y)| y - line.at(*x))
                .collect();
            let mut own = vec![Column::zeros(); trace.x.len()];
            let mut rest = vec![0.0; grid.x.len()];
            for (k, x) in grid.x.iter().enumerate() {
                let Some(stencil) = &grid.sights[c][k] else {
                    continue;
                };
                let subset = grid.subsets[k];
                let mut column = Column::zeros();
                let forms = designs.weights(subset).unwrap_or_default();
                for (j, weights) in forms.iter().enumerate() {
                    column[j] = scale * gauge.slope[k] * weights[c];
                    column[forms.len() + j] = gauge.height[k] * weights[c];
                }
                if let Some(weights) = designs.closing(subset) {
                    column[2 * n - 2] = scale * closing.slope[k] * weights[c];
                    column[2 * n - 1] = closing.height[k] * weights[c];
                }
                rest[k] = stencil.of(&detrended);
                let xi = (x - center) / scale;
                for row in 0..2 * n {
                    matrix[(row, c)] += column[row] * xi;
                    matrix[(row, n + c)] += column[row];
                    right[row] += column[row] * rest[k];
                }
                for (i, weight) in stencil.terms() {
                    own[i] += weight * column;
                }
            }
            columns.push(own);
            rests.push(rest);
        }
        let inverse: DMatrix<f64> = matrix.try_inverse().ok_or_else(too_few)?;
        if !inverse.iter().all(|v| v.is_finite()) {
            return Err(too_few());
        }
        let mut products = DMatrix::zeros(2 * n, 2 * n);
        for (trace, own) in traces.iter().zip(&mut columns) {
            for (column, count) in own.iter_mut().zip(&trace.count) {
                for a in 0..2 * n {
                    for b in 0..2 * n {
                        products[(a, b)] += column[a] * column[b] / count;
                    }
                }
                *column /= *count;
            }
        }
        let change = &inverse * right;
        let lines = first
            .iter()
            .enumerate()
            .map(|(c, line)| Line {
                center,
                mean: line.at(center) + change[n + c],
                slope: line.slope + change[c] / scale,
            })
            .collect();
        for (c, rest) in rests.iter_mut().enumerate() {
            for ((k, x), value) in grid.x.iter().enumerate().zip(rest) {
                if grid.sights[c][k].is_some() {
                    *value -= change[n + c] + change[c] * (x - center) / scale;
                }
            }
        }
        Ok(Self {
            grid,
            lines,
            rests,
            center,
            scale,
            inverse,
            products,
            columns,
            counts: traces.iter().map(|t| &t.count[..]).collect(),
            partners: vec![None; n],
        })
    }

    /// The same, where readings of these pairs of traces at one place are correlated.
    #[must_use]
    pub fn sharing(mut self, traces: &[Trace], pairs: &[(usize, usize)], correlation: f64) -> Self {
        if correlation == 0.0 {
            return self;
        }
        let same = self.grid.same;
        let n = 2 * self.lines.len();
        for (a, b) in pairs {
            for (own, other) in [(*a, *b), (*b, *a)] {
                let (x, at) = (&traces[own].x, &traces[other].x);
                let partner = |x: &f64| {
                    let near = at.partition_point(|p| *p < x - same);
                    at.get(near).is_some_and(|p| *p <= x + same).then_some(near)
                };
                let points: Vec<Option<usize>> = x.iter().map(partner).collect();
                for (i, j) in points.iter().enumerate() {
                    let Some(j) = *j else { continue };
                    let counts = (self.counts[own][i] * self.counts[other][j]).sqrt();
                    let (left, right) = (&self.columns[own][i], &self.columns[other][j]);
                    for p in 0..n {
                        for q in 0..n {
                            self.products[(p, q)] += correlation * counts * left[p] * right[q];
                        }
                    }
                }
                self.partners[own] = Some(Partner {
                    trace: other,
                    correlation,
                    points,
                });
            }
        }
        self
    }

    /// The covariance of the slopes (µm/mm) for noise 1.
    pub fn slopes(&self) -> DMatrix<f64> {
        let n = self.lines.len();
        let rows = self.inverse.rows(0, n);
        rows * &self.products * rows.transpose() / (self.scale * self.scale)
    }

    /// The partner of a trace, and its point where this one is.
    fn partner(&self, trace: usize, point: usize) -> Option<(&Partner, usize)> {
        let partner = self.partners[trace].as_ref()?;
        Some((partner, partner.points[point]?))
    }

    /// The variance of Σ weight·rest of the channels at position k of the grid, for noise 1.
    pub fn variance(&self, k: usize, weights: &[f64]) -> f64 {
        let n = self.lines.len();
        let xi = (self.grid.x[k] - self.center) / self.scale;
        let mut own = 0.0;
        let mut with_conditions = DVector::zeros(2 * n);
        let mut by_line = DVector::zeros(2 * n);
        for (c, weight) in weights.iter().enumerate() {
            let Some(stencil) = self.grid.sights[c][k].filter(|_| *weight != 0.0) else {
                continue;
            };
            by_line[c] = weight * xi;
            by_line[n + c] = *weight;
            for (i, a) in stencil.terms() {
                own += (weight * a).powi(2) / self.counts[c][i];
                for row in 0..2 * n {
                    with_conditions[row] += weight * a * self.columns[c][i][row];
                }
                let Some((partner, j)) = self.partner(c, i) else {
                    continue;
                };
                let counts = self.counts[partner.trace][j] / self.counts[c][i];
                for row in 0..2 * n {
                    with_conditions[row] += partner.correlation
                        * weight
                        * a
                        * counts.sqrt()
                        * self.columns[partner.trace][j][row];
                }
                let seen = self.grid.sights[partner.trace][k].iter();
                let there = seen
                    .flat_map(Stencil::terms)
                    .filter(|(point, _)| *point == j);
                let other: f64 = there.map(|(_, a)| weights[partner.trace] * a).sum();
                own += partner.correlation * weight * a * other
                    / (self.counts[c][i] * self.counts[partner.trace][j]).sqrt();
            }
        }
        let through = self.inverse.tr_mul(&by_line);
        let lines = through.dot(&(&self.products * &through));
        (own - 2.0 * through.dot(&with_conditions) + lines).max(0.0)
    }
}
