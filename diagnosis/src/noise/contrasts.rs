//! Differences between repeats, and how likely a law of noise makes them.

use std::collections::BTreeMap;
use std::ops::Range;

use errsep_models::model::{AnyModel, FittedModel, Place};
use nalgebra::DVector;

use crate::levels::LONG_TRACE;
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

/// What a law says of the contrasts, its scale left open.
pub(crate) struct Likelihood {
    /// −ln L at the best scale; up to a constant also when the scale is integrated out (1/w).
    pub minus_log: f64,
    /// Quadratic form; over [`Contrasts::count`] it is the best scale.
    pub quadratic: f64,
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
        let long = self
            .groups
            .iter()
            .filter(|g| g.positions.len() >= LONG_TRACE);
        let reach = long
            .map(|g| {
                let n = g.positions.len();
                let length = (g.positions[n - 1] - g.positions[0]).abs();
                (length / (n - 1) as f64, length)
            })
            .fold((f64::INFINITY, 0.0f64), |(a, b), (spacing, length)| {
                (a.min(spacing), b.max(length))
            });
        (reach.0 > 0.0 && reach.0.is_finite()).then_some(reach)
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

    /// The likelihood of a correlated part and a shift, both in units of the white variance.
    ///
    /// The Ornstein–Uhlenbeck part is Markov, so one pass of the Kalman filter gives determinant
    /// and quadratic form; the shift is a rank-one update.
    pub fn likelihood(&self, correlated: f64, length: f64, shift: f64) -> Likelihood {
        let (mut quadratic, mut log_determinant) = (0.0, 0.0);
        let mut steps: Vec<Step> = Vec::new();
        for group in &self.groups {
            steps.clear();
            let x = &group.positions;
            let (mut ones, mut variance) = (0.0, correlated);
            let (mut one1, mut log_totals) = (0.0, 0.0);
            for k in 0..x.len() {
                let mut decay = 0.0;
                if k > 0 && correlated > 0.0 {
                    decay = (-(x[k] - x[k - 1]).abs() / length).exp();
                    ones *= decay;
                    variance = decay * decay * variance + correlated * (1.0 - decay * decay);
                }
                let total = variance + 1.0;
                let e1 = 1.0 - ones;
                one1 += e1 * e1 / total;
                log_totals += total.ln();
                let gain = variance / total;
                ones += gain * e1;
                variance *= 1.0 - gain;
                steps.push(Step {
                    decay,
                    gain,
                    e1: e1 / total,
                    weight: 1.0 / total,
                });
            }
            for y in &group.rows {
                let (mut state, mut yy, mut y1) = (0.0, 0.0, 0.0);
                for (step, value) in steps.iter().zip(y.values.iter()) {
                    state *= step.decay;
                    let innovation = value - state;
                    yy += innovation * innovation * step.weight;
                    y1 += innovation * step.e1;
                    state += step.gain * innovation;
                }
                quadratic += yy - shift * y1 * y1 / (1.0 + shift * one1);
                log_determinant += log_totals + (shift * one1).ln_1p();
            }
        }
        let count = self.count() as f64;
        let quadratic = quadratic.max(f64::MIN_POSITIVE);
        Likelihood {
            minus_log: 0.5 * (count * (quadratic / count).ln() + log_determinant),
            quadratic,
        }
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

/// The filter at one reading: the same for all contrasts on the same positions.
struct Step {
    decay: f64,
    gain: f64,
    /// Innovation of 1 over its variance.
    e1: f64,
    /// 1 / variance of the innovation.
    weight: f64,
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
            correlated in 0.0f64..3.0, length in 0.5f64..20.0, shift in 0.0f64..2.0,
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
            let covariance = NoiseLaw::of(1.0, correlated, length, shift).covariance(&x);
            let factor = covariance.cholesky().unwrap();
            let log_determinant = 2.0 * factor.l().diagonal().map(f64::ln).sum();
            let (mut quadratic, mut determinants) = (0.0, 0.0);
            for row in contrasts.rows() {
                quadratic += row.dot(&factor.solve(row));
                determinants += log_determinant;
            }
            let count = contrasts.count() as f64;
            let dense = 0.5 * (count * (quadratic / count).ln() + determinants);
            let filtered = contrasts.likelihood(correlated, length, shift);
            // Rounding: twelve readings a row, condition of the covariance below 100.
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
