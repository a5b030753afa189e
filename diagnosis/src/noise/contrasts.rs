//! Differences between repeats, and how likely a law of noise makes them.

use std::collections::BTreeMap;
use std::ops::Range;

use errsep_models::model::{AnyModel, FittedModel, Place};
use errsep_models::noise::{Law, Likelihood, Likelihoods, OfWhole, spacing_and_length};
use nalgebra::DVector;

use crate::noise::law::NoiseLaw;
use crate::noise::whitening::Whitening;

/// Contrasts of the repeats of all traces, each with the covariance of one trace.
pub(crate) struct Contrasts {
    groups: Vec<Group>,
}

/// Contrasts of traces on the same positions.
struct Group {
    positions: Vec<f64>,
    rows: Vec<Row>,
}

/// A contrast of the repeats of one channel in one direction.
pub(crate) struct Row {
    pub channel: usize,
    backward: bool,
    /// Which of the contrasts of its repeats.
    which: usize,
    pub values: DVector<f64>,
}

impl Row {
    /// Whether it is the same contrast of another channel.
    pub fn is_beside(&self, other: &Self, channel: usize) -> bool {
        self.channel == channel && self.backward == other.backward && self.which == other.which
    }
}

impl Contrasts {
    /// Of a model's readings, or of what is left of them.
    pub fn of(model: &AnyModel, readings: &DVector<f64>) -> Self {
        Self::new(model.places(), model.traces(), &model.levelled(readings))
    }

    pub fn new(places: &[Place], traces: &[Range<usize>], readings: &DVector<f64>) -> Self {
        let mut contrasts = Self { groups: Vec::new() };
        for alike in repeated(places, traces) {
            let traces: Vec<&Range<usize>> = alike.iter().map(|k| &traces[*k]).collect();
            let times: Vec<f64> = traces
                .iter()
                .map(|t| places[(*t).clone()].iter().map(|p| p.time).sum::<f64>() / t.len() as f64)
                .collect();
            let positions: Vec<f64> = places[traces[0].clone()].iter().map(|p| p.x).collect();
            let begin = places.get(traces[0].start);
            for (which, weights) in steady_free(&times).into_iter().enumerate() {
                let mut values = DVector::zeros(positions.len());
                for (weight, trace) in weights.iter().zip(&traces) {
                    values += *weight * readings.rows(trace.start, trace.len());
                }
                let row = Row {
                    channel: begin.map_or(0, |place| place.channel),
                    backward: begin.is_some_and(|place| place.direction < 0.0),
                    which,
                    values,
                };
                contrasts.add(&positions, row);
            }
        }
        contrasts
    }

    fn add(&mut self, positions: &[f64], row: Row) {
        match self.groups.iter_mut().find(|g| g.positions == positions) {
            Some(group) => group.rows.push(row),
            None => self.groups.push(Group {
                positions: positions.to_vec(),
                rows: vec![row],
            }),
        }
    }

    /// Number of readings in all contrasts.
    pub fn count(&self) -> usize {
        self.rows().map(DVector::len).sum()
    }

    /// Variance of the readings about the mean of their contrast, free of shifts, and its degrees
    /// of freedom.
    pub fn scatter(&self) -> (f64, f64) {
        let scatter: f64 = self
            .rows()
            .map(|t| t.add_scalar(-t.mean()).norm_squared())
            .sum();
        let freedom = self.rows().map(|t| t.len() as f64 - 1.0).sum::<f64>();
        (scatter / freedom.max(1.0), freedom.max(1.0))
    }

    /// Mean spacing and length of the traces, where any is long enough to show more than white noise.
    pub fn reach(&self) -> Option<(f64, f64)> {
        let rows = self
            .groups
            .iter()
            .flat_map(|g| g.rows.iter().map(move |_| &g.positions));
        spacing_and_length(rows.filter_map(|x| Some((x.len(), *x.first()?, *x.last()?))))
    }

    fn rows(&self) -> impl Iterator<Item = &DVector<f64>> {
        let rows = self.groups.iter().flat_map(|g| &g.rows);
        rows.map(|row| &row.values)
    }

    /// Positions with the contrasts on them.
    pub fn groups(&self) -> impl Iterator<Item = (&[f64], &[Row])> {
        let groups = self.groups.iter();
        groups.map(|g| (g.positions.as_slice(), g.rows.as_slice()))
    }

    /// The contrasts whitened by a law: each has the covariance of one trace.
    pub fn whitened(mut self, law: &NoiseLaw) -> Self {
        for group in &mut self.groups {
            let whitening = Whitening::new(law, &group.positions);
            for row in &mut group.rows {
                whitening.whiten(row.values.as_mut_slice());
            }
        }
        self
    }

    /// The likelihood of a law, its scale left open.
    pub fn likelihood(&self, law: &Law) -> Likelihood {
        let whole = [OfWhole {
            shift: law.shift / law.white,
            drift: law.drift / law.white,
        }];
        let mut sums = Likelihoods::new(&whole);
        for group in &self.groups {
            let rows = group.rows.iter().map(|row| row.values.as_slice());
            let along = (1.0, law.correlated / law.white, law.length);
            sums.add(&group.positions, 1.0, rows, along);
        }
        sums.found()[0]
    }
}

/// Which traces repeat each other: read of the same cells in the same direction.
pub(crate) fn repeated(places: &[Place], traces: &[Range<usize>]) -> Vec<Vec<usize>> {
    let mut alike: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
    for (k, trace) in traces.iter().enumerate() {
        let mut key: Vec<usize> = places[trace.clone()].iter().map(|p| p.cell).collect();
        let begin = places.get(trace.start);
        key.push(usize::from(begin.is_some_and(|p| p.direction < 0.0)));
        alike.entry(key).or_default().push(k);
    }
    alike.into_values().collect()
}

/// Orthonormal contrasts of repeats at given times, orthogonal to {1, t}; to {1} for two repeats.
fn steady_free(times: &[f64]) -> Vec<Vec<f64>> {
    let r = times.len();
    let mean = times.iter().sum::<f64>() / r as f64;
    let mut basis: Vec<Vec<f64>> = vec![vec![1.0; r]];
    if r > 2 {
        basis.push(times.iter().map(|t| t - mean).collect());
    }
    let fixed = basis.len();
    basis.extend((0..r).map(|k| (0..r).map(|j| f64::from(u8::from(j == k))).collect()));
    let mut kept: Vec<Vec<f64>> = Vec::new();
    let mut first = 0;
    for (k, mut vector) in basis.into_iter().enumerate() {
        let size = norm(&vector);
        for _ in 0..2 {
            for other in &kept {
                let along: f64 = vector.iter().zip(other).map(|(a, b)| a * b).sum();
                for (v, o) in vector.iter_mut().zip(other) {
                    *v -= along * o;
                }
            }
        }
        let left = norm(&vector);
        if left > 1e-6 * size && left > 0.0 {
            kept.push(vector.iter().map(|v| v / left).collect());
            if k < fixed {
                first = kept.len();
            }
        }
    }
    kept.split_off(first)
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn repeats(positions: &[f64], traces: usize) -> (Vec<Place>, Vec<Range<usize>>) {
        let n = positions.len();
        let places = (0..n * traces)
            .map(|k| Place {
                channel: 0,
                x: positions[k % n],
                time: (k / n) as f64,
                repeat: (k / n) as u32,
                direction: 1.0,
                cell: k % n,
            })
            .collect();
        (places, (0..traces).map(|t| t * n..(t + 1) * n).collect())
    }

    proptest! {
        /// The filter's likelihood is that of the dense covariance, with the scale at its best.
        #[test]
        fn the_likelihood_is_the_dense_one(
            correlated in 0.0f64..3.0, length in 0.5f64..20.0, shift in 0.0f64..2.0, drift in 0.0f64..1.0,
            steps in prop::collection::vec(0.1f64..4.0, 5..12),
            values in prop::collection::vec(-2.0f64..2.0, 52),
        ) {
            let mut x = vec![0.0];
            for step in steps {
                x.push(x[x.len() - 1] + step);
            }
            let (places, traces) = repeats(&x, 4);
            let readings = DVector::from_column_slice(&values[..places.len().min(52)]);
            prop_assume!(readings.len() == places.len());
            let contrasts = Contrasts::new(&places, &traces, &readings);
            let law = Law { white: 1.0, correlated, length, shift, drift };
            let covariance = NoiseLaw::stated(law).covariance(&x);
            let factor = covariance.cholesky().unwrap();
            let log_determinant = 2.0 * factor.l().diagonal().map(f64::ln).sum();
            let (mut quadratic, mut determinants) = (0.0, 0.0);
            for row in contrasts.rows() {
                quadratic += row.dot(&factor.solve(row));
                determinants += log_determinant;
            }
            let count = contrasts.count() as f64;
            let dense = 0.5 * (count * (quadratic / count).ln() + determinants);
            let filtered = contrasts.likelihood(&law);
            // Rounding: twelve readings a row, condition of the covariance below 10 000.
            prop_assert!((filtered.minus_log - dense).abs() < 1e-9 * (1.0 + dense.abs()));
            prop_assert!((filtered.quadratic / quadratic - 1.0).abs() < 1e-9);
        }

        /// Neither what all repeats have nor what grows evenly from one to the next is in a contrast.
        #[test]
        fn a_steady_drift_is_in_no_contrast(
            form in prop::collection::vec(-5.0f64..5.0, 6),
            drift in prop::collection::vec(-5.0f64..5.0, 6),
        ) {
            let x: Vec<f64> = (0..6).map(f64::from).collect();
            let (places, traces) = repeats(&x, 5);
            let readings = DVector::from_fn(30, |k, _| form[k % 6] + drift[k % 6] * (k / 6) as f64);
            let contrasts = Contrasts::new(&places, &traces, &readings);
            prop_assert_eq!(contrasts.count(), 18);
            // Rounding of sums of five terms below 25.
            prop_assert!(contrasts.rows().all(|row| row.amax() < 1e-12));
        }
    }
}
