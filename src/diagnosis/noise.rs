//! Noise first: the covariance of the readings from repeats alone.
//!
//! One reading = white noise + a part correlated along its trace (Ornstein–Uhlenbeck: variance
//! o, correlation exp(−|Δx|/ℓ)) + a shift of the whole trace. Repeats of a trace differ by noise,
//! but also by whatever drifts steadily between them; contrasts orthogonal to {1, t} hold neither
//! the model nor the drift, so their likelihood estimates the noise alone.

use std::collections::BTreeMap;
use std::ops::Range;

use errsep_models::model::{FittedModel, Place};
use nalgebra::{DMatrix, DVector};

use super::search::compass;
use super::space::Space;

/// How far the noise is known from the readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseSource {
    /// From repeats.
    Repeats,
    /// Stated in the set-up.
    Stated,
    /// From differences of neighbouring readings: effects rougher than the spacing count as noise.
    Neighbours,
}

/// The law of the noise; variances in the square of the reading's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseLaw {
    /// Variance of the white part.
    pub white: f64,
    /// Variance of the part correlated along a trace.
    pub correlated: f64,
    /// Its correlation length, in the unit of the positions.
    pub length: f64,
    /// Variance of the shift of a whole trace.
    pub shift: f64,
    /// Degrees of freedom behind the white and correlated parts.
    pub freedom: f64,
    /// Degrees of freedom behind the shift.
    pub shift_freedom: f64,
    /// Where it comes from.
    pub source: NoiseSource,
}

impl NoiseLaw {
    /// White noise of a known standard deviation.
    pub fn white(sigma: f64, freedom: f64, source: NoiseSource) -> Self {
        Self {
            white: sigma * sigma,
            correlated: 0.0,
            length: 1.0,
            shift: 0.0,
            freedom,
            shift_freedom: freedom,
            source,
        }
    }

    /// Standard deviation of one reading.
    pub fn sigma(&self) -> f64 {
        (self.white + self.correlated + self.shift).sqrt()
    }

    /// Covariance of the readings of one trace.
    pub fn covariance(&self, positions: &[f64]) -> DMatrix<f64> {
        DMatrix::from_fn(positions.len(), positions.len(), |i, j| {
            let apart = (positions[i] - positions[j]).abs();
            let same = if i == j { self.white } else { 0.0 };
            same + self.correlated * (-apart / self.length).exp() + self.shift
        })
    }

    /// The law that the repeats of a model's readings follow, or what stands in for it.
    pub fn estimate<M: FittedModel>(
        model: &M,
        readings: &DVector<f64>,
        residual: &DVector<f64>,
    ) -> Self {
        let contrasts = Contrasts::new(model.places(), model.traces(), readings);
        let count: usize = contrasts.traces.iter().map(DVector::len).sum();
        if count >= 8 {
            return if model.correlated_noise() {
                contrasts.likeliest()
            } else {
                contrasts.white()
            };
        }
        match model.stated_noise() {
            Some(sigma) => Self::white(sigma, f64::INFINITY, NoiseSource::Stated),
            None => neighbours(model.traces(), residual),
        }
    }
}

/// White noise from second differences of the residuals, (e₋ − 2e₀ + e₊)/√6, by their median.
fn neighbours(traces: &[Range<usize>], residual: &DVector<f64>) -> NoiseLaw {
    let (sigma, freedom) = second_differences(traces, residual);
    let sigma = sigma.max(f64::MIN_POSITIVE.sqrt());
    NoiseLaw::white(sigma, freedom, NoiseSource::Neighbours)
}

/// Standard deviation of the residuals as neighbours tell it, and its degrees of freedom.
fn second_differences(traces: &[Range<usize>], residual: &DVector<f64>) -> (f64, f64) {
    let mut differences: Vec<f64> = traces
        .iter()
        .flat_map(|trace| {
            let e = residual.rows(trace.start, trace.len());
            (2..trace.len()).map(move |k| (e[k - 2] - 2.0 * e[k - 1] + e[k]).abs() / 6f64.sqrt())
        })
        .collect();
    differences.sort_by(f64::total_cmp);
    let median = differences
        .get(differences.len() / 2)
        .copied()
        .unwrap_or(0.0);
    // 0.6745: the median of the absolute value of a standard normal number. The median uses 37 %
    // of the information of overlapping differences, which hold 35/18 times that of one reading.
    let freedom = 0.37 * differences.len() as f64 * 18.0 / 35.0;
    (median / 0.6745, freedom.max(1.0))
}

/// The scatter of neighbouring readings against what the repeats say of it.
pub(super) struct Scatter {
    pub seen: f64,
    pub expected: f64,
    /// Of their ratio.
    pub relative_std: f64,
}

/// The scatter of neighbours in readings free of causes, where there are enough of them.
pub(super) fn neighbour_scatter<M: FittedModel>(
    model: &M,
    law: &NoiseLaw,
    clean: &DVector<f64>,
) -> Option<Scatter> {
    let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
    let space = Space::new(model, &unit);
    let residual = space.forward_vector(clean);
    let (seen, freedom) = second_differences(model.traces(), &residual);
    let gaps: Vec<f64> = model
        .traces()
        .iter()
        .flat_map(|t| {
            model.places()[t.clone()]
                .windows(2)
                .map(|w| (w[1].x - w[0].x).abs())
        })
        .collect();
    if freedom < 20.0 || gaps.is_empty() {
        return None;
    }
    let spacing = gaps.iter().sum::<f64>() / gaps.len() as f64;
    let along = (-spacing / law.length).exp();
    // Variance of (e₋ − 2e₀ + e₊)/√6 under the law; the fit has taken its part of the white noise.
    let correlated = law.correlated * (6.0 - 8.0 * along + 2.0 * along * along) / 6.0;
    let kept = space.degrees_of_freedom() as f64 / space.readings().max(1) as f64;
    Some(Scatter {
        seen,
        expected: (kept * (law.white + correlated)).sqrt(),
        relative_std: (0.5 / freedom + 0.5 / law.freedom.max(1.0)).sqrt(),
    })
}

/// Differences between repeats of a trace, each with the covariance of one trace.
struct Contrasts {
    positions: Vec<Vec<f64>>,
    traces: Vec<DVector<f64>>,
}

impl Contrasts {
    fn new(places: &[Place], traces: &[Range<usize>], readings: &DVector<f64>) -> Self {
        let mut groups: BTreeMap<Vec<usize>, Vec<&Range<usize>>> = BTreeMap::new();
        for trace in traces {
            let mut key: Vec<usize> = places[trace.clone()].iter().map(|p| p.cell).collect();
            key.push(usize::from(
                places.get(trace.start).is_some_and(|p| p.direction < 0.0),
            ));
            groups.entry(key).or_default().push(trace);
        }
        let mut contrasts = Self {
            positions: Vec::new(),
            traces: Vec::new(),
        };
        for group in groups.values() {
            let times: Vec<f64> = group
                .iter()
                .map(|t| places[(*t).clone()].iter().map(|p| p.time).sum::<f64>() / t.len() as f64)
                .collect();
            for weights in steady_free(&times) {
                let mut sum = DVector::zeros(group[0].len());
                for (weight, trace) in weights.iter().zip(group) {
                    sum += *weight * readings.rows(trace.start, trace.len());
                }
                contrasts
                    .positions
                    .push(places[group[0].clone()].iter().map(|p| p.x).collect());
                contrasts.traces.push(sum);
            }
        }
        contrasts
    }

    /// White noise from the scatter of each contrast about its own mean, free of shifts.
    fn white(&self) -> NoiseLaw {
        let scatter: f64 = self
            .traces
            .iter()
            .map(|t| t.add_scalar(-t.mean()).norm_squared())
            .sum();
        let freedom: f64 = self.traces.iter().map(|t| t.len() as f64 - 1.0).sum();
        let sigma = (scatter / freedom.max(1.0)).sqrt();
        NoiseLaw::white(
            sigma.max(f64::MIN_POSITIVE.sqrt()),
            freedom.max(1.0),
            NoiseSource::Repeats,
        )
    }

    fn likeliest(&self) -> NoiseLaw {
        let spacing = self
            .positions
            .iter()
            .filter(|p| p.len() > 1)
            .map(|p| (p[p.len() - 1] - p[0]).abs() / (p.len() - 1) as f64)
            .fold(f64::INFINITY, f64::min);
        let readings: f64 = self.traces.iter().map(|t| t.len() as f64).sum();
        let long = self.traces.iter().any(|t| t.len() >= 20) && spacing.is_finite();
        let lengths: &[f64] = if long { &[1.5, 4.0, 10.0] } else { &[] };
        let none = f64::NEG_INFINITY;
        let mut best = [none, none, 0.0];
        let mut best_value = self.minus_log_likelihood(&best).0;
        if long {
            let (at, value) = compass(&[none, -3.0, 0.0], &[0.0, 1.0, 0.0], 1e-2, |p| {
                self.minus_log_likelihood(p).0
            });
            // A component must earn its parameters: two units of log-likelihood each.
            if value < best_value - 2.0 {
                (best, best_value) = ([at[0], at[1], at[2]], value);
            }
        }
        for length in lengths {
            for shift in [none, -2.0] {
                let start = [0.0, shift, (length * spacing).ln()];
                let steps = [0.7, if shift == none { 0.0 } else { 1.0 }, 0.5];
                let (at, value) = compass(&start, &steps, 1e-2, |p| self.minus_log_likelihood(p).0);
                let cost = 4.0 - 2.0 * f64::from(u8::from(best[0] > none))
                    + 2.0 * f64::from(u8::from(shift > none))
                    - 2.0 * f64::from(u8::from(best[1] > none));
                let sensible = at[2] > (0.3 * spacing).ln() && at[2] < (200.0 * spacing).ln();
                if sensible && value < best_value - cost.max(0.0) {
                    (best, best_value) = ([at[0], at[1], at[2]], value);
                }
            }
        }
        let (_, scale) = self.minus_log_likelihood(&best);
        let shift_freedom = self.freedom(&best, 1, self.traces.len() as f64);
        let freedom = if best[0] > none {
            self.freedom(&best, 0, readings).min(readings)
        } else {
            readings
        };
        NoiseLaw {
            white: scale,
            correlated: scale * best[0].exp(),
            length: if best[0] > none { best[2].exp() } else { 1.0 },
            shift: scale * best[1].exp(),
            freedom,
            shift_freedom,
            source: NoiseSource::Repeats,
        }
    }

    /// 2 / var(ln θ) of one component from the curvature of the likelihood, at most `most`.
    fn freedom(&self, at: &[f64; 3], component: usize, most: f64) -> f64 {
        if !at[component].is_finite() {
            return most;
        }
        let step = 0.1;
        let value = |shift: f64| {
            let mut moved = *at;
            moved[component] += shift;
            self.minus_log_likelihood(&moved).0
        };
        let curvature = (value(step) - 2.0 * value(0.0) + value(-step)) / (step * step);
        (2.0 * curvature).clamp(1.0, most.max(1.0))
    }

    /// −ln L, profiled over the scale, of the ratios ln(o/w), ln(s/w) and ln ℓ; with the scale w.
    ///
    /// The Ornstein–Uhlenbeck part is Markov, so one pass of the Kalman filter gives determinant
    /// and quadratic form; the shift is a rank-one update.
    fn minus_log_likelihood(&self, p: &[f64]) -> (f64, f64) {
        let (correlated, shift, length) = (p[0].exp(), p[1].exp(), p[2].exp());
        let (mut quadratic, mut log_determinant, mut count) = (0.0, 0.0, 0.0);
        for (y, x) in self.traces.iter().zip(&self.positions) {
            let (mut state, mut ones, mut variance) = (0.0, 0.0, correlated);
            let (mut yy, mut y1, mut one1) = (0.0, 0.0, 0.0);
            for k in 0..y.len() {
                if k > 0 {
                    let decay = (-(x[k] - x[k - 1]).abs() / length).exp();
                    state *= decay;
                    ones *= decay;
                    variance = decay * decay * variance + correlated * (1.0 - decay * decay);
                }
                let total = variance + 1.0;
                let (ey, e1) = (y[k] - state, 1.0 - ones);
                yy += ey * ey / total;
                y1 += ey * e1 / total;
                one1 += e1 * e1 / total;
                log_determinant += total.ln();
                let gain = variance / total;
                state += gain * ey;
                ones += gain * e1;
                variance *= 1.0 - gain;
            }
            quadratic += yy - shift * y1 * y1 / (1.0 + shift * one1);
            log_determinant += (shift * one1).ln_1p();
            count += y.len() as f64;
        }
        let scale = (quadratic / count).max(f64::MIN_POSITIVE);
        (0.5 * (count * scale.ln() + log_determinant), scale)
    }
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
