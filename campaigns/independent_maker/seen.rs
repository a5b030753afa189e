//! What of a change shows beside the noise as it is, also where it is correlated: a generalised
//! least-squares fit of its own.

use nalgebra::{DMatrix, DVector};

use crate::design::{Schedule, Trace};
use crate::noise::Noise;
use crate::projection::{absorbed, cell};

/// What the fit with free forms takes up, in units of the noise, and how readings are brought to these.
pub struct Seen {
    /// Lower triangles of the covariances of the traces, one a trace.
    roots: Vec<DMatrix<f64>>,
    /// An orthonormal basis of what is taken up, one row a reading.
    basis: DMatrix<f64>,
}

impl Seen {
    /// Of readings and their noise; none where the noise has no size.
    pub fn new(schedule: &Schedule, noise: &Noise) -> Option<Self> {
        let roots: Option<Vec<DMatrix<f64>>> = schedule
            .traces
            .iter()
            .map(|trace| Some(covariance(trace, noise).cholesky()?.unpack()))
            .collect();
        let roots = roots?;
        let (taken, row_of) = absorbed(schedule);
        let columns = taken.ncols();
        let readings: usize = roots.iter().map(DMatrix::nrows).sum();
        let mut all = DMatrix::zeros(readings, columns);
        let mut from = 0;
        for (trace, root) in schedule.traces.iter().zip(&roots) {
            let rows = root.nrows();
            for (k, moment) in trace.moments().enumerate() {
                let row = row_of[cell(schedule, &moment)];
                all.row_mut(from + k).copy_from(&taken.row(row));
            }
            let mut block = all.rows(from, rows).into_owned();
            root.solve_lower_triangular_mut(&mut block);
            all.rows_mut(from, rows).copy_from(&block);
            from += rows;
        }
        let inverse = all
            .tr_mul(&all)
            .cholesky()?
            .l()
            .solve_lower_triangular(&DMatrix::identity(columns, columns))?;
        Some(Self {
            roots,
            basis: all * inverse.transpose(),
        })
    }

    /// How far a change is from nothing, in standard deviations.
    pub fn of(&self, change: &[Vec<f64>]) -> f64 {
        self.left(change).norm()
    }

    /// How far a change is from another of any size, in standard deviations.
    pub fn beside(&self, change: &[Vec<f64>], other: &[Vec<f64>]) -> f64 {
        let (mut left, other) = (self.left(change), self.left(other));
        let square = other.norm_squared();
        if square > 0.0 {
            left.axpy(-left.dot(&other) / square, &other, 1.0);
        }
        left.norm()
    }

    fn left(&self, change: &[Vec<f64>]) -> DVector<f64> {
        let mut all = Vec::with_capacity(self.basis.nrows());
        for (values, root) in change.iter().zip(&self.roots) {
            let mut block = DVector::from_column_slice(values);
            root.solve_lower_triangular_mut(&mut block);
            all.extend(block.iter().copied());
        }
        let mut all = DVector::from_vec(all);
        all -= &self.basis * self.basis.tr_mul(&all);
        all
    }
}

/// The covariance of the readings of one trace, µm².
fn covariance(trace: &Trace, noise: &Noise) -> DMatrix<f64> {
    let x: Vec<f64> = trace.moments().map(|moment| moment.x).collect();
    let variance = noise.sigma * noise.sigma;
    // Rounding spreads evenly over one step.
    let own = variance * (1.0 - noise.correlated) + noise.resolution * noise.resolution / 12.0;
    DMatrix::from_fn(x.len(), x.len(), |i, j| {
        let kept = (-(x[i] - x[j]).abs() / noise.length).exp();
        variance * noise.correlated * kept + if i == j { own } else { 0.0 }
    })
}
