//! Differences between repeats of a trace, and how likely a law of noise makes them.

use super::likelihood::{Likelihood, Likelihoods, OfWhole};
use super::posterior::NoiseValues;
use super::{ends, spacing_and_length};

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
    /// In the unit of the values: a shift or a drift of one.
    one: f64,
    rows: Vec<Vec<f64>>,
}

impl Contrasts {
    /// Adds the contrasts of repeats that were read at the same positions (not decreasing): one less
    /// than there are repeats, after Helmert.
    /// Values may be weighted: `one` is what a shift of one is in them, the same shift in traces of any weight.
    pub fn add(&mut self, positions: &[f64], repeats: &[Vec<f64>], one: f64) {
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
        let alike = |g: &&mut Group| g.positions == positions && g.one == one;
        match self.groups.iter_mut().find(alike) {
            Some(group) => group.rows.extend(rows),
            None => self.groups.push(Group {
                positions: positions.to_vec(),
                one,
                rows,
            }),
        }
    }
}

impl Contrasts {
    /// Adds those of others.
    pub fn extend(&mut self, others: &Self) {
        self.groups.extend(others.groups.iter().cloned());
    }
}

impl NoiseValues for Contrasts {
    fn count(&self) -> usize {
        let of = |g: &Group| g.positions.len() * g.rows.len();
        self.groups.iter().map(of).sum()
    }

    fn reach(&self) -> Option<(f64, f64)> {
        let rows = self
            .groups
            .iter()
            .flat_map(|g| g.rows.iter().map(move |_| g));
        spacing_and_length(rows.filter_map(|g| ends(&g.positions)))
    }

    fn has_shifts(&self) -> bool {
        true
    }

    fn likelihoods(
        &self,
        white: f64,
        correlated: f64,
        length: f64,
        whole: &[OfWhole],
    ) -> Vec<Likelihood> {
        let mut sums = Likelihoods::new(whole);
        for group in &self.groups {
            let rows = group.rows.iter().map(Vec::as_slice);
            sums.add(
                &group.positions,
                group.one,
                rows,
                (white, correlated, length),
            );
        }
        sums.found()
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::about_middle;
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        /// The filter's likelihood is that of the covariance written out, its scale at the best.
        #[test]
        fn the_likelihood_is_the_dense_one(
            white in 0.2f64..1.0, correlated in 0.0f64..3.0, length in 0.5f64..20.0,
            shift in 0.0f64..2.0, drift in 0.0f64..1.0, steps in prop::collection::vec(0.1f64..4.0, 5..12),
            values in prop::collection::vec(-2.0f64..2.0, 36),
        ) {
            let mut x = vec![0.0];
            for step in steps {
                x.push(x[x.len() - 1] + step);
            }
            let n = x.len();
            let repeats: Vec<Vec<f64>> = (0..3).map(|r| values[r * n..(r + 1) * n].to_vec()).collect();
            let mut contrasts = Contrasts::default();
            contrasts.add(&x, &repeats, 1.0);
            prop_assert_eq!(contrasts.count(), 2 * n);
            let places = about_middle(&x);
            let covariance = DMatrix::from_fn(n, n, |i, j| {
                let own = if i == j { white } else { 0.0 };
                let lines = drift * places[i] * places[j];
                own + correlated * (-(x[i] - x[j]).abs() / length).exp() + shift + lines
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
            let found = contrasts.likelihoods(white, correlated, length, &[OfWhole::default(), OfWhole { shift, drift }])[1];
            // Epsilons: twelve readings a row, condition of the covariance below 10 000.
            prop_assert!((found.minus_log - dense).abs() < 1e-9 * (1.0 + dense.abs()));
            prop_assert!((found.quadratic / quadratic - 1.0).abs() < 1e-9);
        }
    }
}
