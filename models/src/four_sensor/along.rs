//! Noise that is correlated along the slide, as the outputs tell it against each other where nothing is repeated.
//!
//! With F the two combinations of the outputs that hold no S and no γ ([`Geometry::slide_free`]) and n + oₛ the surface point
//! under sensor s at slide position n,
//!
//! ```text
//!     dₖ(n) = Σₛ Fₛₖ f(n + oₛ) + noise,      c(n) = Σₜ Fₜ₂ d₁(n + oₜ) − Fₜ₁ d₂(n + oₜ) = Σₛₜ (Fₛ₁Fₜ₂ − Fₛ₂Fₜ₁) mₛ(n + oₜ)
//! ```
//!
//! holds no f either, and no zero-adjustments: it is a moving sum of the noise of the sensors, whose law makes its
//! autocovariance. What the model misses is in it too.

use rand::Rng;

use super::Outputs;
use crate::noise::{Law, Likelihood, NoiseValues, OfWhole, Posterior, WithinCells};

/// Values of c that are taken together; what is correlated over more of them is hardly seen in c.
const WINDOW: usize = 200;
/// Windows, spread evenly along the slide.
const MOST_WINDOWS: usize = 10;

/// c in windows, with the places and weights of the noise in it.
struct AgainstEachOther {
    /// Δx, mm.
    step: f64,
    /// By sensor, how far on in steps each output is taken and its weight.
    sums: [[(usize, f64); 4]; 4],
    windows: Vec<Vec<f64>>,
}

impl AgainstEachOther {
    fn of(outputs: &Outputs) -> Self {
        let geometry = outputs.geometry();
        let (free, offsets) = (geometry.slide_free(), geometry.offsets());
        let sums = std::array::from_fn(|s| {
            std::array::from_fn(|t| {
                let weight = free[(s, 0)] * free[(t, 1)] - free[(s, 1)] * free[(t, 0)];
                (offsets[t], weight)
            })
        });
        let readings = outputs.readings();
        let count = readings.len().saturating_sub(offsets[3]);
        let at = |n: usize| -> f64 {
            let of = |s: usize| {
                let terms: &[(usize, f64); 4] = &sums[s];
                terms.iter().map(move |(on, w)| w * readings[n + on][s])
            };
            (0..4).flat_map(of).sum()
        };
        let length = count.min(WINDOW);
        let windows = (count / length.max(1)).min(MOST_WINDOWS);
        let first = |k: usize| (count - length) * k / (windows.max(2) - 1);
        let window = |k: usize| (first(k)..first(k) + length).map(at).collect();
        Self {
            step: geometry.step(),
            sums,
            windows: (0..windows).map(window).collect(),
        }
    }

    fn length(&self) -> usize {
        self.windows.first().map_or(0, Vec::len)
    }

    /// Autocovariance of c under a law.
    fn autocovariance(&self, (white, correlated, length): (f64, f64, f64)) -> Vec<f64> {
        let decay = (-self.step / length).exp();
        let of_noise = |lag: usize| {
            let own = if lag == 0 { white } else { 0.0 };
            own + correlated * decay.powf(lag as f64)
        };
        let terms = self.sums.iter().flat_map(|sums| {
            let with = |(a, u): &(usize, f64)| {
                let (a, u) = (*a, *u);
                sums.map(|(b, v)| (a, b, u * v))
            };
            sums.iter().flat_map(with).collect::<Vec<_>>()
        });
        let mut found = vec![0.0; self.length()];
        for (a, b, weight) in terms {
            for (lag, value) in found.iter_mut().enumerate() {
                *value += weight * of_noise((lag + a).abs_diff(b));
            }
        }
        found
    }
}

impl NoiseValues for AgainstEachOther {
    fn count(&self) -> usize {
        self.windows.iter().map(Vec::len).sum()
    }

    fn reach(&self) -> Option<(f64, f64)> {
        let length = self.length();
        crate::noise::spacing_and_length(std::iter::once((
            length,
            0.0,
            self.step * length.saturating_sub(1) as f64,
        )))
    }

    /// They drop out.
    fn has_shifts(&self) -> bool {
        false
    }

    fn likelihoods(
        &self,
        white: f64,
        correlated: f64,
        length: f64,
        whole: &[OfWhole],
    ) -> Vec<Likelihood> {
        let covariance = self.autocovariance((white, correlated, length));
        let (quadratic, log_determinant) = predicted(&covariance, &self.windows);
        let count = self.count() as f64;
        let quadratic = quadratic.max(f64::MIN_POSITIVE);
        let log_determinant = log_determinant * self.windows.len() as f64;
        let found = Likelihood {
            minus_log: 0.5 * (count * (quadratic / count).ln() + log_determinant),
            quadratic,
        };
        vec![found; whole.len()]
    }
}

/// Σ over rows of r'V⁻¹r and ln |V| for V with this autocovariance: each value is predicted from those before it (Durbin, Rev. Inst.
/// Int. Stat. 28 (1960) 233).
fn predicted(autocovariance: &[f64], rows: &[Vec<f64>]) -> (f64, f64) {
    let Some(mut variance) = autocovariance.first().copied() else {
        return (0.0, 0.0);
    };
    let mut weights: Vec<f64> = Vec::with_capacity(autocovariance.len());
    let (mut quadratic, mut log) = (0.0, 0.0);
    for n in 0..autocovariance.len() {
        if n > 0 {
            let known: f64 = (weights.iter().zip(autocovariance[1..n].iter().rev()))
                .map(|(w, c)| w * c)
                .sum();
            let last = (autocovariance[n] - known) / variance;
            let turned: Vec<f64> = weights.iter().rev().copied().collect();
            for (w, t) in weights.iter_mut().zip(turned) {
                *w -= last * t;
            }
            weights.push(last);
            variance *= 1.0 - last * last;
        }
        log += variance.ln();
        for row in rows {
            let before = row[..n].iter().rev().zip(&weights);
            let error = row[n] - before.map(|(r, w)| r * w).sum::<f64>();
            quadratic += error * error / variance;
        }
    }
    (quadratic, log)
}

/// Noise that is correlated along the slide.
#[derive(Debug, Clone)]
pub struct Along {
    laws: Posterior,
    step: f64,
    positions: usize,
}

impl Along {
    /// What outputs that were read once tell; none where their noise may be white, or is no noise.
    pub fn of(outputs: &Outputs) -> Option<Self> {
        let values = AgainstEachOther::of(outputs);
        let laws = Posterior::of(&values)?;
        laws.may_be_noise(&WithinCells::default()).then_some(Self {
            laws,
            step: values.step,
            positions: outputs.readings().len(),
        })
    }

    /// The mean of the laws, µm².
    pub fn law(&self) -> Law {
        self.laws.mean()
    }

    /// Degrees of freedom of the variance of the longest wave over the slide.
    pub(super) fn freedom(&self) -> f64 {
        let each = self.laws.possible().iter();
        let longest = each.map(|p| p.law.of_wave(self.step, 1, self.positions));
        self.laws.variance(&longest.collect::<Vec<_>>()).1
    }

    /// Noise of outputs, µm, of the scale that goes with [`Self::freedom`].
    pub(super) fn drawn(&self, outputs: &Outputs, random: &mut impl Rng) -> Vec<[f64; 4]> {
        let freedom = self.freedom();
        let law = self.law().times((freedom - 2.0) / freedom);
        let positions = outputs.slide_positions();
        let mut noise = vec![[0.0; 4]; positions.len()];
        let mut own = vec![0.0; positions.len()];
        for sensor in 0..4 {
            law.draw(&positions, random, &mut own);
            for (row, own) in noise.iter_mut().zip(&own) {
                row[sensor] = *own;
            }
        }
        noise
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::four_sensor::Geometry;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// 150 positions over a surface and a slide of drawn values, sensors set to heights of their own.
    fn outputs(law: &Law, size: f64, seed: u64) -> Outputs {
        let geometry = Geometry::new(5.0, [1, 2, 4], 150).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut value = || size * (random.random::<f64>() - 0.5);
        let surface: Vec<f64> = (0..157).map(|_| value()).collect();
        let slide: Vec<[f64; 2]> = (0..150).map(|_| [value(), value()]).collect();
        let heights: [f64; 4] = std::array::from_fn(|_| value());
        let x: Vec<f64> = (0..150).map(|n| 5.0 * f64::from(n)).collect();
        let noise: [Vec<f64>; 4] = std::array::from_fn(|_| {
            let mut own = vec![0.0; 150];
            law.draw(&x, &mut random, &mut own);
            own
        });
        let rows = (0..150).map(|n| {
            std::array::from_fn(|s| {
                let on = geometry.offsets()[s];
                let of_slide = slide[n][0] + on as f64 * slide[n][1];
                surface[n + on] + of_slide + heights[s] + noise[s][n]
            })
        });
        Outputs::new(geometry, 0.0, rows.collect()).unwrap()
    }

    const LAW: Law = Law {
        white: 0.005,
        correlated: 0.005,
        length: 30.0,
        shift: 0.0,
        drift: 0.0,
    };

    /// *Limit*: whatever surface, slide and heights are, nothing of them is in c.
    #[test]
    fn no_form_is_in_what_outputs_say_against_each_other() {
        let found = AgainstEachOther::of(&outputs(&Law::of_white(0.0), 100.0, 1));
        assert_eq!(found.count(), 143);
        // Rounding of sums of hundreds.
        assert!(found.windows[0].iter().all(|c| c.abs() < 1e-11));
    }

    /// *Limit*: quadratic form and determinant are those of the dense matrix.
    #[test]
    fn predictions_are_the_dense_matrix() {
        let found = AgainstEachOther::of(&outputs(&LAW, 0.0, 2));
        let row = &found.windows[0];
        let own = found.autocovariance((0.6, 0.4, 25.0));
        let dense = DMatrix::from_fn(row.len(), row.len(), |i, j| own[i.abs_diff(j)]);
        let factor = dense.cholesky().unwrap();
        let left = DVector::from_column_slice(row);
        let square = left.dot(&factor.solve(&left));
        let log: f64 = factor.l().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
        let (quadratic, log_determinant) = predicted(&own, &found.windows);
        // Rounding, times a condition number of some thousands.
        assert!((quadratic / square - 1.0).abs() < 1e-9);
        assert!((log_determinant - log).abs() < 1e-9);
    }

    /// *Simulated truth*: of 30 sets each, correlated noise is told in most, white noise in few.
    #[test]
    fn correlated_noise_is_told_and_white_noise_is_not() {
        let told = |law: &Law| {
            let laws = (0..30).filter_map(|seed| Along::of(&outputs(law, 3.0, seed)));
            laws.map(|along| along.law()).collect::<Vec<_>>()
        };
        let (there, not) = (told(&LAW), told(&Law::of_white(0.01)));
        assert!(there.len() >= 24, "{}", there.len());
        // At even odds at most one in five: more than twelve of 30 have a probability of 10⁻³.
        assert!(not.len() <= 12, "{}", not.len());
        // k·u: of one set the variance is known to 15 %, of 24 to 4 %. Slow noise is hardly seen in c, so that the mean of the laws has
        // more of it: up to a third.
        let mut variances: Vec<f64> = there.iter().map(Law::of_readings).collect();
        variances.sort_by(f64::total_cmp);
        let median = variances[variances.len() / 2];
        assert!(median > 0.008 && median < 0.0133, "{median}");
    }
}
