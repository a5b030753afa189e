//! L⁻¹ and L⁻ᵀ of the noise of one trace, linear in its readings.
//!
//! V = A + s 1 1ᵀ + d ξ ξᵀ with A white plus Ornstein–Uhlenbeck noise, ξ the positions about the middle of the trace. A is
//! Markov along the trace, so its
//! inverse factor B is the innovations form of the Kalman filter; with w₁, w₂ orthogonal and
//! w₁w₁ᵀ + w₂w₂ᵀ = B (s 1 1ᵀ + d ξ ξᵀ) Bᵀ, L⁻¹ = (I − Σ cₖ wₖ wₖᵀ) B with cₖ = (1 − 1/√(1 + qₖ))/qₖ, qₖ = |wₖ|².

use errsep_models::noise::about_middle;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::noise::law::NoiseLaw;

/// A white part smaller than this of the whole variance would make V singular to rounding.
const BREATH: f64 = 1e-12;

/// The inverse factor of the covariance of one trace.
#[derive(Debug, Clone)]
pub(crate) struct Whitening {
    /// What is left of the correlated part at each reading from the one before.
    decay: Vec<f64>,
    /// Gain of the filter.
    gain: Vec<f64>,
    /// Innovations in units of their standard deviation.
    scale: Vec<f64>,
    /// wₖ and cₖ.
    of_whole: Vec<(DVector<f64>, f64)>,
    correlated: bool,
}

impl Whitening {
    pub fn new(law: &NoiseLaw, positions: &[f64]) -> Self {
        let law = &law.parts;
        let floor = (BREATH * law.variance()).max(f64::MIN_POSITIVE);
        let white = law.white.max(floor);
        let n = positions.len();
        let mut made = Self {
            decay: vec![0.0; n],
            gain: vec![0.0; n],
            scale: vec![0.0; n],
            of_whole: Vec::new(),
            correlated: law.correlated > 0.0,
        };
        let mut variance = law.correlated;
        for k in 0..n {
            if k > 0 {
                let decay = (-(positions[k] - positions[k - 1]).abs() / law.length).exp();
                variance = decay * decay * variance + law.correlated * (1.0 - decay * decay);
                made.decay[k] = decay;
            }
            let total = variance + white;
            made.scale[k] = 1.0 / total.sqrt();
            made.gain[k] = variance / total;
            variance *= white / total;
        }
        let shift = vec![law.shift.sqrt(); n];
        let places = about_middle(positions).into_iter();
        let drift = places.map(|place| law.drift.sqrt() * place).collect();
        let mut filtered: Vec<DVector<f64>> = Vec::new();
        for (size, mut of_whole) in [(law.shift, shift), (law.drift, drift)] {
            if size > 0.0 && n > 0 {
                made.filter(&mut of_whole);
                filtered.push(DVector::from_vec(of_whole));
            }
        }
        made.of_whole = orthogonal(filtered)
            .into_iter()
            .map(|w| (w.norm_squared(), w))
            .filter(|(q, _)| *q > 0.0)
            .map(|(q, w)| (w, (1.0 - 1.0 / (1.0 + q).sqrt()) / q))
            .collect();
        made
    }

    /// B y.
    fn filter(&self, y: &mut [f64]) {
        if !self.correlated {
            y.iter_mut().zip(&self.scale).for_each(|(y, s)| *y *= s);
            return;
        }
        let mut state = 0.0;
        for (k, y) in y.iter_mut().enumerate() {
            state *= self.decay[k];
            let innovation = *y - state;
            state += self.gain[k] * innovation;
            *y = self.scale[k] * innovation;
        }
    }

    /// ln |V|.
    pub fn log_determinant(&self) -> f64 {
        let own: f64 = self.scale.iter().map(|s| -2.0 * s.ln()).sum();
        let whole = self.of_whole.iter().map(|(w, _)| w.norm_squared().ln_1p());
        own + whole.sum::<f64>()
    }

    /// L⁻¹ y, in place.
    pub fn whiten(&self, y: &mut [f64]) {
        self.filter(y);
        self.pull_back(y);
    }

    /// L⁻ᵀ z, in place: the filter run backward.
    pub fn adjoint(&self, z: &mut [f64]) {
        self.pull_back(z);
        if !self.correlated {
            z.iter_mut().zip(&self.scale).for_each(|(z, s)| *z *= s);
            return;
        }
        let mut state = 0.0;
        for (k, z) in z.iter_mut().enumerate().rev() {
            let innovation = self.scale[k] * *z + self.gain[k] * state;
            *z = innovation;
            state = self.decay[k] * (state - innovation);
        }
    }

    fn pull_back(&self, y: &mut [f64]) {
        for (w, pull) in &self.of_whole {
            let along: f64 = w.iter().zip(y.iter()).map(|(w, y)| w * y).sum();
            for (y, w) in y.iter_mut().zip(w.iter()) {
                *y -= pull * along * w;
            }
        }
    }
}

/// Orthogonal vectors of the same sum of products w wᵀ as at most two.
fn orthogonal(vectors: Vec<DVector<f64>>) -> Vec<DVector<f64>> {
    if vectors.len() < 2 {
        return vectors;
    }
    let together = DMatrix::from_columns(&vectors);
    let axes = SymmetricEigen::new(together.tr_mul(&together)).eigenvectors;
    let turned = together * axes;
    turned.column_iter().map(|w| w.clone_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use errsep_models::noise::Law;
    use proptest::prelude::*;

    proptest! {
        /// L⁻¹ V L⁻ᵀ = I against the dense covariance, and the adjoint is the transpose.
        #[test]
        fn the_covariance_becomes_the_identity(
            white in 0.1f64..2.0, correlated in 0.0f64..3.0, length in 0.5f64..50.0,
            shift in 0.0f64..3.0, drift in 0.0f64..1.0, steps in prop::collection::vec(0.01f64..5.0, 1..20),
        ) {
            let mut x = vec![0.0];
            for step in steps {
                x.push(x[x.len() - 1] + step);
            }
            let law = NoiseLaw::stated(Law { white, correlated, length, shift, drift });
            let whitening = Whitening::new(&law, &x);
            let n = x.len();
            let mut inverse = DMatrix::identity(n, n);
            let mut adjoint = DMatrix::identity(n, n);
            for k in 0..n {
                whitening.whiten(inverse.column_mut(k).as_mut_slice());
                whitening.adjoint(adjoint.column_mut(k).as_mut_slice());
            }
            let identity = &inverse * law.covariance(&x) * inverse.transpose();
            let factor = law.covariance(&x).cholesky().unwrap();
            let dense: f64 = factor.l().diagonal().map(|pivot| 2.0 * pivot.ln()).sum();
            // Rounding: twenty logarithms of pivots between 0.1 and 10.
            prop_assert!((whitening.log_determinant() - dense).abs() < 1e-10);
            // Rounding: the condition of V is below 20·8/0.1, each product has 20 terms.
            prop_assert!((identity - DMatrix::identity(n, n)).amax() < 1e-11);
            prop_assert!((adjoint - inverse.transpose()).amax() < 1e-13 * 20.0 / white);
        }
    }

    #[test]
    fn noise_without_a_white_part_stays_finite() {
        let whitening = Whitening::new(&NoiseLaw::of(0.0, 1.0, 3.0, 0.5), &[0.0, 1.0, 1.0, 2.0]);
        let mut y = [1.0, -2.0, 0.5, 4.0];
        whitening.whiten(&mut y);
        assert!(y.iter().all(|v| v.is_finite()));
    }
}
