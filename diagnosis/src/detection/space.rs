//! Readings in units of their noise, with what the fit can absorb projected out.
//!
//! With V = L Lᵀ the covariance of the readings, r̃ = L⁻¹ r; with P the projector onto the
//! complement of the whitened Jacobian, e = P r̃ is standard normal there when the model is true.
//! Profiles that are free at every position and traces that share their positions make P a
//! Kronecker product, so nothing here is ever a readings × unknowns matrix of them.

use std::ops::Range;
use std::sync::Arc;

use errsep_models::model::{AnyModel, Column, FittedModel, Freedom, Profiles, Record};
use nalgebra::{DMatrix, DVector};

use crate::detection::basis::{inner_products, orthonormal, with_volume};
use crate::detection::loose::Loose;
use crate::detection::scatter::{Scatter, ScatterRoot};
use crate::detection::shared_scatter::SharedRoot;
use crate::noise::law::NoiseLaw;
use crate::noise::whitening::Whitening;

/// The whitened space of one set of readings under one model and one law of noise.
#[derive(Debug, Clone)]
pub struct Space {
    pub(super) readings: usize,
    pub(super) traces: Vec<Range<usize>>,
    /// The trace of every reading.
    pub(super) trace_of: Vec<u32>,
    /// L⁻¹ of each trace.
    pub(super) whitening: Vec<Arc<Whitening>>,
    /// What makes the scatter that the model expects one with the noise.
    pub(super) scatter: Option<Scatter>,
    /// Orthonormal patterns over the traces, traces × functions.
    pub(super) patterns: Option<DMatrix<f64>>,
    /// Directions inside the patterns that the model does not have, given back; orthonormal.
    pub(super) returned: DMatrix<f64>,
    /// The rest of what the fit absorbs; orthonormal.
    pub(super) absorbed: DMatrix<f64>,
    /// Scatter beside what the fit absorbs that is not of single positions.
    pub(super) loose: Loose,
    /// Number of directions the fit absorbs.
    pub rank: usize,
    /// ln |V| + ln |Jᵀ V⁻¹ J|, to a constant of the model and its positions.
    log_determinant: f64,
}

/// Whether scatter is of one position of some traces.
fn is_of_a_position(column: &Column, record: &Record) -> bool {
    column.rows.len() <= record.traces.len()
}

impl Space {
    /// The space of all readings.
    pub fn new<M: FittedModel>(model: &M, law: &NoiseLaw) -> Self {
        let all: Vec<usize> = (0..model.traces().len()).collect();
        Self::of_traces(model, law, &all)
    }

    /// The same beside profiles that are free altogether, whatever the model withholds of them: a line that a profile
    /// must not have is the line of all positions that were read, which single positions may carry.
    pub fn beside_free_profiles(model: &AnyModel, law: &NoiseLaw) -> Self {
        let all: Vec<usize> = (0..model.traces().len()).collect();
        let mut freedom = model.freedom();
        if let Some(profiles) = &mut freedom.profiles {
            profiles.withheld.clear();
        }
        Self::made(model.record(), &freedom, law, &all, &[])
    }

    /// The space of all readings, in units of the noise and of the scatter that the model expects.
    /// (Beside profiles that are free at every position that scatter is common to traces.)
    pub fn expecting(model: &AnyModel, law: &NoiseLaw) -> Self {
        let all: Vec<usize> = (0..model.traces().len()).collect();
        Self::made(
            model.record(),
            &model.freedom(),
            law,
            &all,
            model.expected_scatter(),
        )
    }

    /// The space of the readings of some traces, in the order of those traces.
    pub fn of_traces<M: FittedModel>(model: &M, law: &NoiseLaw, chosen: &[usize]) -> Self {
        Self::made(model.record(), &model.freedom(), law, chosen, &[])
    }

    /// The same with the scatter that the model expects.
    pub fn of_traces_expecting(model: &AnyModel, law: &NoiseLaw, chosen: &[usize]) -> Self {
        Self::made(
            model.record(),
            &model.freedom(),
            law,
            chosen,
            model.expected_scatter(),
        )
    }

    /// `scatter`: by the rows of all readings.
    fn made(
        record: &Record,
        freedom: &Freedom,
        law: &NoiseLaw,
        chosen: &[usize],
        scatter: &[Column],
    ) -> Self {
        let mut traces = Vec::new();
        let mut whitening: Vec<Arc<Whitening>> = Vec::new();
        let mut cache: Vec<(Vec<f64>, Arc<Whitening>)> = Vec::new();
        let mut rows = Vec::new();
        let mut start = 0;
        for &t in chosen {
            let trace = record.traces[t].clone();
            let x: Vec<f64> = record.places[trace.clone()].iter().map(|p| p.x).collect();
            let known = cache.iter().find(|(positions, _)| *positions == x);
            let inverse = if let Some((_, inverse)) = known {
                Arc::clone(inverse)
            } else {
                let inverse = Arc::new(Whitening::new(law, &x));
                cache.push((x, Arc::clone(&inverse)));
                inverse
            };
            whitening.push(inverse);
            traces.push(start..start + trace.len());
            start += trace.len();
            rows.extend(trace);
        }
        let trace_of = traces
            .iter()
            .enumerate()
            .flat_map(|(t, trace): (usize, &Range<usize>)| trace.clone().map(move |_| t as u32))
            .collect();
        let mut space = Self {
            readings: start,
            traces,
            trace_of,
            whitening,
            scatter: None,
            patterns: None,
            returned: DMatrix::zeros(start, 0),
            absorbed: DMatrix::zeros(start, 0),
            loose: Loose::none(start),
            rank: 0,
            log_determinant: 0.0,
        };
        space.scatter = space.scatter_root(scatter, freedom, record, &rows);
        let columns = freedom.columns.select_rows(&rows);
        let mut whitened = columns;
        space.whiten(&mut whitened);
        let sizes: Vec<f64> = whitened.column_iter().map(|c| c.norm()).collect();
        if let Some(profiles) = &freedom.profiles {
            let x: Vec<f64> = chosen.first().map_or_else(Vec::new, |t| {
                let trace = record.traces[*t].clone();
                record.places[trace].iter().map(|p| p.x).collect()
            });
            space.free_profiles(profiles, chosen, &law.covariance(&x));
        }
        space.project_profiles(&mut whitened);
        let (absorbed, log_volume) = with_volume(&whitened, &sizes);
        space.absorbed = absorbed;
        space.rank += space.absorbed.ncols();
        let noise = space.whitening.iter().map(|w| w.log_determinant());
        let expected = space.scatter.as_ref().map_or(0.0, Scatter::log_determinant);
        space.log_determinant += noise.sum::<f64>() + expected + 2.0 * log_volume;
        if let Some(Scatter::Shared(_)) = &space.scatter {
            let along = scatter.iter().filter(|c| !is_of_a_position(c, record));
            let dense = along.map(|column| column.dense(record.places.len()).select_rows(&rows));
            let dense: Vec<DVector<f64>> = dense.collect();
            if !dense.is_empty() {
                let (seen, _) = space.forward(DMatrix::from_columns(&dense));
                space.loose = Loose::new(&seen);
                space.log_determinant += space.loose.log_determinant();
            }
        }
        space
    }

    /// The inverse root of some scatter in whitened readings; `rows`: of the readings among all.
    fn scatter_root(
        &self,
        scatter: &[Column],
        freedom: &Freedom,
        record: &Record,
        rows: &[usize],
    ) -> Option<Scatter> {
        if scatter.is_empty() {
            return None;
        }
        if freedom.profiles.is_some() {
            let whitening = self.whitening.first()?;
            let own = scatter.iter().filter(|c| is_of_a_position(c, record));
            let root = SharedRoot::new(own, &self.traces, rows, whitening);
            return Some(Scatter::Shared(root));
        }
        let whitened = scatter.iter().map(|column| {
            let mut all = DVector::<f64>::zeros(record.places.len());
            for (&row, &value) in column.rows.iter().zip(&column.values) {
                all[row] += value;
            }
            let mut dense = DMatrix::from_fn(self.readings, 1, |k, _| all[rows[k]]);
            self.whiten(&mut dense);
            dense.column(0).clone_owned()
        });
        Some(Scatter::Points(ScatterRoot::new(whitened)))
    }

    fn free_profiles(&mut self, profiles: &Profiles, chosen: &[usize], covariance: &DMatrix<f64>) {
        let mut patterns = profiles.patterns.select_rows(chosen);
        if let Some(Scatter::Shared(root)) = &self.scatter {
            for mut pattern in patterns.column_iter_mut() {
                let left = root.of_traces(&pattern.clone_owned());
                pattern.copy_from(&left);
            }
        }
        let sizes: Vec<f64> = patterns.column_iter().map(|c| c.norm()).collect();
        let (basis, log_volume) = with_volume(&patterns, &sizes);
        let length = self.traces.first().map_or(0, Range::len);
        // |(B ⊗ I)ᵀ (I ⊗ V⁻¹) (B ⊗ I)| of the noise V of one trace.
        let noise = self.whitening.first().map_or(0.0, |w| w.log_determinant());
        self.log_determinant += 2.0 * length as f64 * log_volume - basis.ncols() as f64 * noise;
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
            // The span of {L⁻¹ f : fᵀ profile = 0} has the normal Lᵀ profile = L⁻¹ V profile.
            let Some(whitening) = self.whitening.first() else {
                continue;
            };
            let mut normal = covariance * profile;
            whitening.whiten(normal.as_mut_slice());
            let mut column = DVector::zeros(self.readings);
            for (t, trace) in self.traces.iter().enumerate() {
                column
                    .rows_mut(trace.start, length)
                    .copy_from(&(&normal * own[t]));
            }
            let size = column.norm();
            // Of the profiles with fᵀ profile = 0 alone: |profile| of unit length.
            self.log_determinant += 2.0 * (normal.norm() / profile.norm()).ln();
            let at = returned.ncols();
            returned = returned.insert_column(at, 0.0);
            returned.column_mut(at).copy_from(&(column / size));
        }
        self.rank += basis.ncols() * length - returned.ncols();
        self.patterns = Some(basis);
        self.returned = returned;
    }

    /// ln |V| + ln |Jᵀ V⁻¹ J| of the noise V and of what the fit absorbs, to a constant of the model and its positions.
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Number of readings.
    pub fn readings(&self) -> usize {
        self.readings
    }

    /// Whether the scatter that the model expects is in its units.
    pub fn scatters(&self) -> bool {
        self.scatter.is_some()
    }

    /// Readings less what the fit absorbs.
    pub fn degrees_of_freedom(&self) -> usize {
        self.readings.saturating_sub(self.rank)
    }

    /// L⁻¹ of each column, in place.
    pub fn whiten(&self, columns: &mut DMatrix<f64>) {
        let n = self.readings.max(1);
        for column in columns.as_mut_slice().chunks_mut(n) {
            for (trace, whitening) in self.traces.iter().zip(&self.whitening) {
                whitening.whiten(&mut column[trace.clone()]);
            }
            if let Some(root) = &self.scatter {
                root.apply(column);
            }
        }
    }

    fn project_profiles(&self, columns: &mut DMatrix<f64>) {
        let Some(patterns) = &self.patterns else {
            return;
        };
        let given_back = inner_products(&self.returned, columns);
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
            let along = inner_products(&self.absorbed, columns);
            columns.gemm(-1.0, &self.absorbed, &along, 1.0);
        }
        self.loose.take(columns);
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
        let n = self.readings.max(1);
        for column in columns.as_mut_slice().chunks_mut(n) {
            if let Some(root) = &self.scatter {
                root.apply_transposed(column);
            }
            for (trace, whitening) in self.traces.iter().zip(&self.whitening) {
                whitening.adjoint(&mut column[trace.clone()]);
            }
        }
        columns
    }
}
