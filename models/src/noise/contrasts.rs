//! Differences between repeats of a trace, and how likely a law of noise makes them.

use super::law::decays;
use super::posterior::NoiseValues;

/// A trace of this many readings can show what is correlated along it.
const LONG: usize = 20;

/// Contrasts of repeats: orthonormal combinations over the repeats of a trace, orthogonal to what all
/// repeats have in common. Each has the covariance of one trace.
#[derive(Debug, Clone, Default)]
pub struct Contrasts {
    groups: Vec<Group>,
}

/// Contrasts on the same positions.
#[derive(Debug, Clone)]
struct Group {
    positions: Vec<f64>,
    rows: Vec<Vec<f64>>,
}

/// What a law says of the contrasts, its scale left open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likelihood {
    /// −ln L at the best scale; up to a constant also with the scale integrated out (1/scale).
    pub minus_log: f64,
    /// Quadratic form under the law of scale one; over [`Contrasts::count`] it is the best scale.
    pub quadratic: f64,
}

/// The filter at one reading: the same for all contrasts on the same positions.
struct Step {
    decay: f64,
    gain: f64,
    /// Innovation of a trace of ones over its variance.
    ones: f64,
    /// 1/variance of the innovation.
    weight: f64,
}

impl Contrasts {
    /// Adds the contrasts of repeats that were read at the same positions (not decreasing): one less
    /// than there are repeats, after Helmert.
    pub fn add(&mut self, positions: &[f64], repeats: &[Vec<f64>]) {
        if positions.is_empty() || repeats.len() < 2 {
            return;
        }
        let mut sum = vec![0.0; positions.len()];
        let mut rows = Vec::with_capacity(repeats.len() - 1);
        for (k, repeat) in repeats.iter().enumerate() {
            if k > 0 {
                let count = k as f64;
                let scale = (count / (count + 1.0)).sqrt();
                let row = repeat.iter().zip(&sum);
                rows.push(row.map(|(y, s)| scale * (y - s / count)).collect());
            }
            for (s, y) in sum.iter_mut().zip(repeat) {
                *s += y;
            }
        }
        match self.groups.iter_mut().find(|g| g.positions == positions) {
            Some(group) => group.rows.extend(rows),
            None => self.groups.push(Group {
                positions: positions.to_vec(),
                rows,
            }),
        }
    }
}

impl NoiseValues for Contrasts {
    fn count(&self) -> usize {
        let of = |g: &Group| g.positions.len() * g.rows.len();
        self.groups.iter().map(of).sum()
    }

    /// Least mean spacing and greatest length of the traces that are long enough to show more than
    /// white noise.
    fn reach(&self) -> Option<(f64, f64)> {
        let (spacing, length) = self
            .groups
            .iter()
            .filter(|g| g.positions.len() >= LONG)
            .map(|g| {
                let n = g.positions.len();
                let length = g.positions[n - 1] - g.positions[0];
                (length / (n - 1) as f64, length)
            })
            .fold((f64::INFINITY, 0.0_f64), |(a, b), (spacing, length)| {
                (a.min(spacing), b.max(length))
            });
        (spacing > 0.0 && spacing.is_finite()).then_some((spacing, length))
    }

    fn has_shifts(&self) -> bool {
        true
    }

    /// The correlated part is Markov, so one pass of the Kalman filter gives determinant and quadratic
    /// form; a shift is an update of rank one.
    fn likelihoods(
        &self,
        white: f64,
        correlated: f64,
        length: f64,
        shifts: &[f64],
    ) -> Vec<Likelihood> {
        let mut quadratics = vec![0.0; shifts.len()];
        let mut log_determinants = vec![0.0; shifts.len()];
        let mut steps: Vec<Step> = Vec::new();
        for group in &self.groups {
            steps.clear();
            let (mut ones, mut variance) = (0.0, correlated);
            let (mut ones_squared, mut log_totals) = (0.0, 0.0);
            for (k, decay) in decays(&group.positions, length).into_iter().enumerate() {
                if k > 0 {
                    ones *= decay;
                    variance = decay * decay * variance + correlated * (1.0 - decay * decay);
                }
                let total = variance + white;
                let innovation = 1.0 - ones;
                ones_squared += innovation * innovation / total;
                log_totals += total.ln();
                let gain = variance / total;
                ones += gain * innovation;
                variance *= 1.0 - gain;
                steps.push(Step {
                    decay,
                    gain,
                    ones: innovation / total,
                    weight: 1.0 / total,
                });
            }
            for row in &group.rows {
                let (mut state, mut own, mut along) = (0.0, 0.0, 0.0);
                for (step, value) in steps.iter().zip(row) {
                    state *= step.decay;
                    let innovation = value - state;
                    own += innovation * innovation * step.weight;
                    along += innovation * step.ones;
                    state += step.gain * innovation;
                }
                for (s, shift) in shifts.iter().enumerate() {
                    quadratics[s] += own - shift * along * along / (1.0 + shift * ones_squared);
                    log_determinants[s] += log_totals + (shift * ones_squared).ln_1p();
                }
            }
        }
        let count = self.count() as f64;
        quadratics
            .into_iter()
            .zip(log_determinants)
            .map(|(quadratic, log_determinant)| {
                let quadratic = quadratic.max(f64::MIN_POSITIVE);
                Likelihood {
                    minus_log: 0.5 * (count * (quadratic / count).ln() + log_determinant),
                    quadratic,
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        /// The filter's likelihood is that of the covariance written out, its scale at the best.
        #[test]
        fn the_likelihood_is_the_dense_one(
            white in 0.2f64..1.0, correlated in 0.0f64..3.0, length in 0.5f64..20.0,
            shift in 0.0f64..2.0, steps in prop::collection::vec(0.1f64..4.0, 5..12),
            values in prop::collection::vec(-2.0f64..2.0, 36),
        ) {
            let mut x = vec![0.0];
            for step in steps {
                x.push(x[x.len() - 1] + step);
            }
            let n = x.len();
            let repeats: Vec<Vec<f64>> = (0..3).map(|r| values[r * n..(r + 1) * n].to_vec()).collect();
            let mut contrasts = Contrasts::default();
            contrasts.add(&x, &repeats);
            prop_assert_eq!(contrasts.count(), 2 * n);
            let covariance = DMatrix::from_fn(n, n, |i, j| {
                let own = if i == j { white } else { 0.0 };
                own + correlated * (-(x[i] - x[j]).abs() / length).exp() + shift
            });
            let factor = covariance.cholesky().unwrap();
            let log_determinant = 2.0 * factor.l().diagonal().map(f64::ln).sum();
            // Helmert's contrasts of three repeats, written out.
            let root = |v: f64| v.sqrt();
            let weights = [
                [-1.0 / root(2.0), 1.0 / root(2.0), 0.0],
                [-1.0 / root(6.0), -1.0 / root(6.0), 2.0 / root(6.0)],
            ];
            let mut quadratic = 0.0;
            for row in weights {
                let y = DVector::from_fn(n, |k, _| (0..3).map(|r| row[r] * repeats[r][k]).sum());
                quadratic += y.dot(&factor.solve(&y));
            }
            let count = 2.0 * n as f64;
            let dense = 0.5 * (count * (quadratic / count).ln() + 2.0 * log_determinant);
            let found = contrasts.likelihoods(white, correlated, length, &[0.0, shift])[1];
            // Epsilons: twelve readings a row, condition of the covariance below 500.
            prop_assert!((found.minus_log - dense).abs() < 1e-9 * (1.0 + dense.abs()));
            prop_assert!((found.quadratic / quadratic - 1.0).abs() < 1e-9);
        }
    }
}
