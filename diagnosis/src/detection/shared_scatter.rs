//! The root of the covariance of scatter that traces have in common, position by position.
//!
//! In whitened readings scatter of variance s at each position of n traces, the same in all of them, adds s 1 1ᵀ
//! over those traces. 1 (1 − (1 + n s)^−½)/n 1ᵀ taken from I is the inverse root, position by position, so it goes
//! with profiles that are free at every position. Under noise that is correlated along a trace the scatter is
//! taken as white with its mean variance in whitened readings.

use std::collections::BTreeMap;
use std::ops::Range;

use errsep_models::model::Column;
use nalgebra::{DMatrix, DVector};

use crate::noise::whitening::Whitening;

/// The inverse root.
#[derive(Debug, Clone)]
pub(crate) struct SharedRoot {
    groups: Vec<Group>,
    length: usize,
}

/// Traces with the same scatter.
#[derive(Debug, Clone)]
struct Group {
    traces: Vec<usize>,
    /// First readings of the traces.
    starts: Vec<usize>,
    /// The part of their mean that is taken away.
    part: f64,
}

impl SharedRoot {
    /// The root of columns that each hold one value at one position of some traces. `traces`: of equal lengths;
    /// `rows`: the row of the columns of each of their readings; `whitening`: of one trace.
    pub fn new<'c>(
        columns: impl Iterator<Item = &'c Column>,
        traces: &[Range<usize>],
        rows: &[usize],
        whitening: &Whitening,
    ) -> Self {
        let length = traces.first().map_or(0, Range::len);
        let mut place_of: BTreeMap<usize, usize> = BTreeMap::new();
        for (t, trace) in traces.iter().enumerate() {
            place_of.extend(trace.clone().map(|k| (rows[k], t)));
        }
        // By the traces: sum of the variances.
        let mut variances: BTreeMap<Vec<usize>, f64> = BTreeMap::new();
        for column in columns {
            let mut touched = Vec::new();
            let mut square = 0.0;
            for (row, value) in column.rows.iter().zip(&column.values) {
                if let Some(t) = place_of.get(row) {
                    touched.push(*t);
                    square += value * value;
                }
            }
            if !touched.is_empty() {
                let variance = square / touched.len() as f64;
                *variances.entry(touched).or_default() += variance;
            }
        }
        let mut inverse = DMatrix::<f64>::identity(length, length);
        for mut column in inverse.column_iter_mut() {
            whitening.whiten(column.as_mut_slice());
        }
        let grown = inverse.norm_squared() / length.max(1) as f64;
        let groups = (variances.into_iter())
            .map(|(members, sum)| {
                let count = members.len() as f64;
                let variance = grown * sum / length as f64;
                Group {
                    starts: members.iter().map(|t| traces[*t].start).collect(),
                    traces: members,
                    part: 1.0 - 1.0 / (1.0 + count * variance).sqrt(),
                }
            })
            .collect();
        Self { groups, length }
    }

    /// The root times a vector, in place; it is its own transpose.
    pub fn apply(&self, vector: &mut [f64]) {
        let mut mean = vec![0.0; self.length];
        for group in &self.groups {
            mean.fill(0.0);
            for start in &group.starts {
                let own = &vector[*start..start + self.length];
                mean.iter_mut().zip(own).for_each(|(m, v)| *m += v);
            }
            let part = group.part / group.starts.len() as f64;
            for start in &group.starts {
                let own = &mut vector[*start..start + self.length];
                own.iter_mut().zip(&mean).for_each(|(v, m)| *v -= part * m);
            }
        }
    }

    /// ln |I + Σ s 1 1ᵀ|.
    pub fn log_determinant(&self) -> f64 {
        let each = self.groups.iter().map(|g| -2.0 * (1.0 - g.part).ln());
        self.length as f64 * each.sum::<f64>()
    }

    /// The root times weights of the traces.
    pub fn of_traces(&self, weights: &DVector<f64>) -> DVector<f64> {
        let mut left = weights.clone();
        for group in &self.groups {
            let sum: f64 = group.traces.iter().map(|t| weights[*t]).sum();
            let less = group.part * sum / group.traces.len() as f64;
            group.traces.iter().for_each(|t| left[*t] -= less);
        }
        left
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::law::{NoiseLaw, NoiseSource};

    /// R (σ² I + s 1 1ᵀ by position) Rᵀ = I where the noise is white, over two groups of traces.
    #[test]
    fn the_covariance_becomes_the_identity() {
        let (length, groups) = (5, [vec![0, 2, 3], vec![1, 4]]);
        let traces: Vec<Range<usize>> = (0..5).map(|t| t * length..(t + 1) * length).collect();
        let rows: Vec<usize> = (0..25).collect();
        let columns: Vec<Column> = (groups.iter())
            .flat_map(|own| (0..length).map(move |k| (own, k)))
            .map(|(own, k)| Column {
                rows: own.iter().map(|t| t * length + k).collect(),
                values: vec![0.7; own.len()],
            })
            .collect();
        let law = NoiseLaw::white(0.3, 1e9, NoiseSource::Stated);
        let whitening = Whitening::new(&law, &[0.0, 1.0, 2.0, 3.0, 4.0]);
        let root = SharedRoot::new(columns.iter(), &traces, &rows, &whitening);
        let mut covariance = DMatrix::identity(25, 25) * 0.09;
        for column in &columns {
            let dense = column.dense(25);
            covariance += &dense * dense.transpose();
        }
        let mut inverse = DMatrix::<f64>::identity(25, 25);
        for mut column in inverse.column_iter_mut() {
            for trace in &traces {
                whitening.whiten(&mut column.as_mut_slice()[trace.clone()]);
            }
            root.apply(column.as_mut_slice());
        }
        let identity = &inverse * covariance * inverse.transpose();
        // Rounding.
        assert!((identity - DMatrix::identity(25, 25)).amax() < 1e-12);
    }
}
