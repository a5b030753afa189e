//! Readings in units of their noise, with what the fit can absorb projected out.
//!
//! With V = L Lᵀ the covariance of the readings, r̃ = L⁻¹ r; with P the projector onto the
//! complement of the whitened Jacobian, e = P r̃ is standard normal there when the model is true.
//! Profiles that are free at every position and traces that share their positions make P a
//! Kronecker product, so nothing here is ever a readings × unknowns matrix of them.

use std::ops::Range;
use std::sync::Arc;

use errsep_models::model::{Column, FittedModel, Profiles};
use nalgebra::{DMatrix, DVector};

use super::noise::NoiseLaw;

/// Columns that project to less than this part of their length lie in the span of the others.
const DEPENDENT: f64 = 1e-7;

/// The whitened space of one set of readings under one model and one law of noise.
#[derive(Debug, Clone)]
pub struct Space {
    readings: usize,
    traces: Vec<Range<usize>>,
    /// L⁻¹ of each trace.
    whitening: Vec<Arc<DMatrix<f64>>>,
    /// Orthonormal patterns over the traces, traces × functions.
    patterns: Option<DMatrix<f64>>,
    /// Directions inside the patterns that the model does not have, given back; orthonormal.
    returned: DMatrix<f64>,
    /// The rest of what the fit absorbs; orthonormal.
    absorbed: DMatrix<f64>,
    /// L⁻¹ 1 of each trace.
    ones: Vec<DVector<f64>>,
    /// Number of directions the fit absorbs.
    pub rank: usize,
}

impl Space {
    /// The space of all readings.
    pub fn new<M: FittedModel>(model: &M, law: &NoiseLaw) -> Self {
        let all: Vec<usize> = (0..model.traces().len()).collect();
        Self::of_traces(model, law, &all)
    }

    /// The space of the readings of some traces, in the order of those traces.
    pub fn of_traces<M: FittedModel>(model: &M, law: &NoiseLaw, chosen: &[usize]) -> Self {
        let mut traces = Vec::new();
        let mut whitening: Vec<Arc<DMatrix<f64>>> = Vec::new();
        let mut cache: Vec<(Vec<f64>, Arc<DMatrix<f64>>)> = Vec::new();
        let mut rows = Vec::new();
        let mut start = 0;
        for &t in chosen {
            let trace = model.traces()[t].clone();
            let x: Vec<f64> = model.places()[trace.clone()].iter().map(|p| p.x).collect();
            let known = cache.iter().find(|(positions, _)| *positions == x);
            let inverse = if let Some((_, inverse)) = known {
                Arc::clone(inverse)
            } else {
                let inverse = Arc::new(inverse_factor(&law.covariance(&x)));
                cache.push((x, Arc::clone(&inverse)));
                inverse
            };
            whitening.push(inverse);
            traces.push(start..start + trace.len());
            start += trace.len();
            rows.extend(trace);
        }
        let freedom = model.freedom();
        let ones = whitening.iter().map(|w| w.column_sum()).collect();
        let mut space = Self {
            readings: start,
            traces,
            whitening,
            patterns: None,
            returned: DMatrix::zeros(start, 0),
            absorbed: DMatrix::zeros(start, 0),
            ones,
            rank: 0,
        };
        let columns = freedom.columns.select_rows(&rows);
        let mut whitened = columns;
        space.whiten(&mut whitened);
        let sizes: Vec<f64> = whitened.column_iter().map(|c| c.norm()).collect();
        if let Some(profiles) = &freedom.profiles {
            space.free_profiles(profiles, chosen);
        }
        space.project_profiles(&mut whitened);
        space.absorbed = orthonormal(&whitened, &sizes);
        space.rank += space.absorbed.ncols();
        space
    }

    fn free_profiles(&mut self, profiles: &Profiles, chosen: &[usize]) {
        let patterns = profiles.patterns.select_rows(chosen);
        let sizes: Vec<f64> = patterns.column_iter().map(|c| c.norm()).collect();
        let basis = orthonormal(&patterns, &sizes);
        let length = self.traces.first().map_or(0, Range::len);
        let mut returned = DMatrix::zeros(self.readings, 0);
        for (function, profile) in &profiles.withheld {
            // The part of this function's pattern that no other function has.
            let others: Vec<usize> = (0..patterns.ncols()).filter(|k| k != function).collect();
            let rest = patterns.select_columns(&others);
            let rest_sizes: Vec<f64> = rest.column_iter().map(|c| c.norm()).collect();
            let span = orthonormal(&rest, &rest_sizes);
            let own = patterns.column(*function) - &span * span.tr_mul(&patterns.column(*function));
            if own.norm() < 1e-6 * patterns.column(*function).norm() {
                continue;
            }
            // The span of {L⁻¹ f : fᵀ profile = 0} has the normal Lᵀ profile.
            let Some(factor) = self
                .whitening
                .first()
                .and_then(|w| w.clone().as_ref().clone().try_inverse())
            else {
                continue;
            };
            let normal = factor.tr_mul(profile);
            let mut column = DVector::zeros(self.readings);
            for (t, trace) in self.traces.iter().enumerate() {
                column
                    .rows_mut(trace.start, length)
                    .copy_from(&(&normal * own[t]));
            }
            let size = column.norm();
            let at = returned.ncols();
            returned = returned.insert_column(at, 0.0);
            returned.column_mut(at).copy_from(&(column / size));
        }
        self.rank += basis.ncols() * length - returned.ncols();
        self.patterns = Some(basis);
        self.returned = returned;
    }

    /// Number of readings.
    pub fn readings(&self) -> usize {
        self.readings
    }

    /// Readings less what the fit absorbs.
    pub fn degrees_of_freedom(&self) -> usize {
        self.readings.saturating_sub(self.rank)
    }

    fn whiten(&self, columns: &mut DMatrix<f64>) {
        for (trace, inverse) in self.traces.iter().zip(&self.whitening) {
            let block = columns.rows(trace.start, trace.len()).clone_owned();
            if block.iter().all(|v| *v == 0.0) {
                continue;
            }
            columns
                .rows_mut(trace.start, trace.len())
                .gemm(1.0, inverse, &block, 0.0);
        }
    }

    fn project_profiles(&self, columns: &mut DMatrix<f64>) {
        let Some(patterns) = &self.patterns else {
            return;
        };
        let given_back = self.returned.tr_mul(columns);
        let length = self.traces.first().map_or(0, Range::len);
        let functions = patterns.ncols();
        let count = columns.ncols();
        for k in 0..functions {
            let mut sum = DMatrix::zeros(length, count);
            for (t, trace) in self.traces.iter().enumerate() {
                let weight = patterns[(t, k)];
                if weight != 0.0 {
                    sum += columns.rows(trace.start, length) * weight;
                }
            }
            for (t, trace) in self.traces.iter().enumerate() {
                let weight = patterns[(t, k)];
                if weight != 0.0 {
                    let mut rows = columns.rows_mut(trace.start, length);
                    rows -= &sum * weight;
                }
            }
        }
        columns.gemm(1.0, &self.returned, &given_back, 1.0);
    }

    fn project(&self, columns: &mut DMatrix<f64>) {
        self.project_profiles(columns);
        if self.absorbed.ncols() > 0 {
            let along = self.absorbed.tr_mul(columns);
            columns.gemm(-1.0, &self.absorbed, &along, 1.0);
        }
    }

    /// P L⁻¹ of each column; also the whitened lengths before the projection.
    pub fn forward(&self, mut columns: DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
        self.whiten(&mut columns);
        let sizes = columns.column_iter().map(|c| c.norm()).collect();
        self.project(&mut columns);
        (columns, sizes)
    }

    /// P L⁻¹ of one vector.
    pub fn forward_vector(&self, vector: &DVector<f64>) -> DVector<f64> {
        let matrix = DMatrix::from_column_slice(vector.len(), 1, vector.as_slice());
        self.forward(matrix).0.column(0).clone_owned()
    }

    /// P L⁻¹ of signatures.
    pub fn forward_columns(&self, columns: &[Column]) -> (DMatrix<f64>, Vec<f64>) {
        let mut dense = DMatrix::zeros(self.readings, columns.len());
        for (k, column) in columns.iter().enumerate() {
            for (&row, &value) in column.rows.iter().zip(&column.values) {
                dense[(row, k)] += value;
            }
        }
        self.forward(dense)
    }

    /// L⁻ᵀ P of each column: what a signature is multiplied with to get its score.
    pub fn adjoint(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        self.project(&mut columns);
        for (trace, inverse) in self.traces.iter().zip(&self.whitening) {
            let block = columns.rows(trace.start, trace.len()).clone_owned();
            columns
                .rows_mut(trace.start, trace.len())
                .gemm_tr(1.0, inverse, &block, 0.0);
        }
        columns
    }

    /// The part of a projected, whitened unit vector's variance that the shifts of traces make up.
    pub fn shift_share(&self, unit: &DVector<f64>, shift: f64) -> f64 {
        self.traces
            .iter()
            .zip(&self.ones)
            .map(|(trace, ones)| shift * unit.rows(trace.start, trace.len()).dot(ones).powi(2))
            .sum()
    }
}

/// L⁻¹ of V = L Lᵀ, with a breath of white noise where V is singular to rounding.
fn inverse_factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let mut lift = 0.0;
    loop {
        let lifted = covariance + DMatrix::identity(n, n) * lift;
        if let Some(inverse) = lifted
            .cholesky()
            .and_then(|c| c.l().solve_lower_triangular(&DMatrix::identity(n, n)))
        {
            return inverse;
        }
        let scale = covariance.diagonal().amax().max(f64::MIN_POSITIVE);
        lift = if lift == 0.0 {
            1e-14 * scale
        } else {
            lift * 10.0
        };
        if lift > scale {
            return DMatrix::identity(n, n);
        }
    }
}

/// An orthonormal basis of the columns that are longer than rounding compared with `sizes`.
pub(super) fn orthonormal(columns: &DMatrix<f64>, sizes: &[f64]) -> DMatrix<f64> {
    let mut kept: Vec<DVector<f64>> = Vec::new();
    for (column, size) in columns.column_iter().zip(sizes) {
        let mut vector = column.clone_owned();
        for _ in 0..2 {
            for other in &kept {
                let along = other.dot(&vector);
                vector.axpy(-along, other, 1.0);
            }
        }
        let length = vector.norm();
        if length > DEPENDENT * size && length > 0.0 {
            kept.push(vector / length);
        }
    }
    if kept.is_empty() {
        DMatrix::zeros(columns.nrows(), 0)
    } else {
        DMatrix::from_columns(&kept)
    }
}
