//! The law of the noise and products with its covariance.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// Variances of the parts of the noise of one reading, in the square of the reading's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// Of the white part.
    pub white: f64,
    /// Of the part correlated along a trace.
    pub correlated: f64,
    /// Correlation length of that part, in the unit of the positions.
    pub length: f64,
    /// Of the shift of a whole trace.
    pub shift: f64,
    /// Of the slope by which a whole trace drifts about its middle, in the square of the unit over that of the positions.
    #[serde(default)]
    pub drift: f64,
}

impl Law {
    /// White noise of a variance.
    pub const fn of_white(variance: f64) -> Self {
        Self {
            white: variance,
            correlated: 0.0,
            length: 1.0,
            shift: 0.0,
            drift: 0.0,
        }
    }

    /// Variance of one reading in the middle of its trace.
    pub fn variance(&self) -> f64 {
        self.white + self.correlated + self.shift
    }

    /// All variances times a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            white: factor * self.white,
            correlated: factor * self.correlated,
            shift: factor * self.shift,
            drift: factor * self.drift,
            ..self
        }
    }

    /// The law of values in which a shift or a drift of one is `one`.
    #[must_use]
    pub fn where_whole_is(self, one: f64) -> Self {
        Self {
            shift: one * one * self.shift,
            drift: one * one * self.drift,
            ..self
        }
    }

    /// Variance of the white and the correlated part of one reading.
    pub fn of_readings(&self) -> f64 {
        self.white + self.correlated
    }

    /// Variance of a wave that goes around so often in so many readings, of white noise and of the correlated part at even steps,
    /// over that of white noise of variance one.
    pub fn of_wave(&self, step: f64, turns: usize, readings: usize) -> f64 {
        let kept = (-step / self.length).exp();
        let turn = (std::f64::consts::TAU * turns as f64 / readings.max(1) as f64).cos();
        let spectrum = (1.0 - kept * kept) / (1.0 - 2.0 * kept * turn + kept * kept);
        self.white + self.correlated * spectrum
    }

    /// Draws the noise of one trace, readings in the order in which they were taken.
    pub fn draw(&self, positions: &[f64], random: &mut impl Rng, noise: &mut [f64]) {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let white = self.white.sqrt();
        let shift = if self.shift > 0.0 {
            self.shift.sqrt() * normal()
        } else {
            0.0
        };
        if self.drift > 0.0 {
            let slope = self.drift.sqrt() * normal();
            for (value, place) in noise.iter_mut().zip(about_middle(positions)) {
                *value = shift + slope * place;
            }
        } else {
            noise.fill(shift);
        }
        if self.correlated <= 0.0 {
            noise.iter_mut().for_each(|v| *v += white * normal());
            return;
        }
        let mut state = self.correlated.sqrt() * normal();
        // Of the last spacing, as most are equal.
        let (mut known, mut decay, mut fresh) = (f64::NAN, 0.0, 0.0);
        for (k, value) in noise.iter_mut().enumerate() {
            if k > 0 {
                let spacing = (positions[k] - positions[k - 1]).abs();
                if spacing != known {
                    known = spacing;
                    decay = (-spacing / self.length).exp();
                    fresh = (self.correlated * (1.0 - decay * decay)).sqrt();
                }
                state = decay * state + fresh * normal();
            }
            *value += state + white * normal();
        }
    }

    /// aᵀVb, V the covariance of the readings of a trace without drift, by one pass; see [`drift_form`].
    pub fn form(&self, decays: &[f64], a: &[f64], b: &[f64]) -> f64 {
        let white: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        let mut sum = self.white * white;
        if self.correlated > 0.0 {
            sum += self.correlated * markov_form(decays, a, b);
        }
        if self.shift > 0.0 {
            sum += self.shift * a.iter().sum::<f64>() * b.iter().sum::<f64>();
        }
        sum
    }

    /// Variance of the sum of squares of n readings of a trace without drift, over 2: the sum of the squares of all
    /// elements of V. `double` are the decays of half the length.
    pub fn squares(&self, decays: &[f64], double: &[f64]) -> f64 {
        let ones = vec![1.0; decays.len()];
        let n = decays.len() as f64;
        let apart = markov_form(decays, &ones, &ones) - n;
        let apart_squared = markov_form(double, &ones, &ones) - n;
        n * self.variance().powi(2)
            + self.correlated.powi(2) * apart_squared
            + 2.0 * self.correlated * self.shift * apart
            + self.shift.powi(2) * n * (n - 1.0)
    }
}

/// Positions of a trace counted from their mean: its middle.
pub fn about_middle(positions: &[f64]) -> Vec<f64> {
    let middle = positions.iter().sum::<f64>() / positions.len().max(1) as f64;
    positions.iter().map(|x| x - middle).collect()
}

/// Σ aᵢ bⱼ ξᵢ ξⱼ over all pairs of a trace, ξ the positions from its middle: what a drift of unit slope makes of aᵀVb.
pub fn drift_form(places: &[f64], a: &[f64], b: &[f64]) -> f64 {
    let along = |of: &[f64]| -> f64 { places.iter().zip(of).map(|(x, v)| x * v).sum() };
    along(a) * along(b)
}

/// What is left of the correlated part from the reading before: exp(−|Δx|/ℓ); zero at the first.
pub fn decays(positions: &[f64], length: f64) -> Vec<f64> {
    let steps = positions
        .windows(2)
        .map(|pair| (-(pair[1] - pair[0]).abs() / length).exp());
    std::iter::once(0.0)
        .chain(steps)
        .take(positions.len())
        .collect()
}

/// Σ aᵢ bⱼ exp(−|xᵢ − xⱼ|/ℓ) over all pairs of a trace, by one pass.
pub fn markov_form(decays: &[f64], a: &[f64], b: &[f64]) -> f64 {
    let (mut before_a, mut before_b, mut sum) = (0.0, 0.0, 0.0);
    for ((decay, a), b) in decays.iter().zip(a).zip(b) {
        before_a *= decay;
        before_b *= decay;
        sum += a * b + a * before_b + b * before_a;
        before_a += a;
        before_b += b;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    /// The covariance written out, element by element.
    fn dense(law: &Law, x: &[f64]) -> DMatrix<f64> {
        DMatrix::from_fn(x.len(), x.len(), |i, j| {
            let own = if i == j { law.white } else { 0.0 };
            own + law.correlated * (-(x[i] - x[j]).abs() / law.length).exp() + law.shift
        })
    }

    proptest! {
        /// One pass gives what the covariance written out gives.
        #[test]
        fn one_pass_is_the_dense_product(
            white in 0.0f64..2.0, correlated in 0.0f64..3.0, length in 0.5f64..50.0,
            shift in 0.0f64..3.0, steps in prop::collection::vec(0.0f64..5.0, 1..20),
            values in prop::collection::vec(-2.0f64..2.0, 42),
        ) {
            let mut x = vec![0.0];
            for step in steps {
                x.push(x[x.len() - 1] + step);
            }
            let n = x.len();
            let law = Law { white, correlated, length, shift, drift: 0.0 };
            let (a, b) = (&values[..n], &values[n..2 * n]);
            let v = dense(&law, &x);
            let expected = DVector::from_column_slice(a).dot(&(&v * DVector::from_column_slice(b)));
            let found = law.form(&decays(&x, length), a, b);
            // Epsilons: 400 terms below 32, in other order.
            prop_assert!((found - expected).abs() < 400.0 * 32.0 * f64::EPSILON, "{found} {expected}");
            let squares = law.squares(&decays(&x, length), &decays(&x, 0.5 * length));
            prop_assert!((squares - v.norm_squared()).abs() < 400.0 * 64.0 * 4.0 * f64::EPSILON);
        }
    }

    #[test]
    fn draws_have_the_variance_of_the_law() {
        use rand::SeedableRng;
        let law = Law {
            white: 1.0,
            correlated: 2.0,
            length: 3.0,
            shift: 0.5,
            drift: 0.3,
        };
        let x = [0.0, 1.0, 1.5, 4.0];
        let w = [1.0, -2.0, 0.5, 0.7];
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let count = 40_000;
        let mut sum = 0.0;
        for _ in 0..count {
            let mut noise = [0.0; 4];
            law.draw(&x, &mut random, &mut noise);
            sum += noise
                .iter()
                .zip(&w)
                .map(|(n, w)| n * w)
                .sum::<f64>()
                .powi(2);
        }
        let expected = law.form(&decays(&x, law.length), &w, &w)
            + law.drift * drift_form(&about_middle(&x), &w, &w);
        // k·u: the mean of 40 000 squares is known to √(2/40 000); four of them.
        assert!((sum / f64::from(count) / expected - 1.0).abs() < 0.029);
    }
}
