//! Values of which each trace holds noise and a straight line that nobody knows.

use super::likelihood::{Likelihood, Likelihoods, OfWhole};
use super::posterior::NoiseValues;
use super::{about_middle, ends, spacing_and_length};

/// Variance of height and slope (at the ends) of the lines, in that of the noise: so great that it tells nothing of them.
const ANY: f64 = 1e8;
/// Unknowns of a line.
const OF_A_LINE: usize = 2;

/// Rows of values on their positions, each with the covariance of one trace beside its line.
#[derive(Debug, Clone, Default)]
pub struct WithoutLines {
    rows: Vec<(Vec<f64>, Vec<f64>)>,
}

impl WithoutLines {
    /// Adds values at positions (not decreasing).
    pub fn add(&mut self, positions: &[f64], values: Vec<f64>) {
        if positions.len() > OF_A_LINE {
            self.rows.push((positions.to_vec(), values));
        }
    }
}

impl NoiseValues for WithoutLines {
    /// Beside the lines.
    fn count(&self) -> usize {
        self.rows.iter().map(|(x, _)| x.len() - OF_A_LINE).sum()
    }

    fn reach(&self) -> Option<(f64, f64)> {
        let positions = self.rows.iter().map(|(positions, _)| positions.as_slice());
        spacing_and_length(positions.filter_map(ends))
    }

    /// They are in the lines.
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
        let (mut quadratic, mut log_determinant) = (0.0, 0.0);
        for (positions, row) in &self.rows {
            let half = about_middle(positions).into_iter().fold(0.0, f64::max);
            let lines = [OfWhole {
                shift: ANY,
                drift: ANY / (half * half).max(f64::MIN_POSITIVE),
            }];
            let mut sums = Likelihoods::new(&lines);
            let rows = std::iter::once(row.as_slice());
            sums.add(positions, 1.0, rows, (white, correlated, length));
            let found = sums.found()[0];
            let n = positions.len() as f64;
            quadratic += found.quadratic;
            log_determinant += 2.0 * found.minus_log - n * (found.quadratic / n).ln();
        }
        let count = self.count() as f64;
        let found = Likelihood {
            minus_log: 0.5 * (count * (quadratic / count).ln() + log_determinant),
            quadratic,
        };
        vec![found; whole.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{Law, Posterior};
    use nalgebra::{DMatrix, DVector};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn drawn(law: &Law, seed: u64, slope: f64) -> (Vec<f64>, WithoutLines) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let x: Vec<f64> = (0..60).map(|k| 2.0 * f64::from(k)).collect();
        let mut values = WithoutLines::default();
        for _ in 0..3 {
            let mut noise = vec![0.0; x.len()];
            law.draw(&x, &mut random, &mut noise);
            let row = noise.iter().zip(&x).map(|(n, x)| n + 3.0 + slope * x);
            values.add(&x, row.collect());
        }
        (x, values)
    }

    /// *Limit*: the restricted likelihood is that of the dense matrices, lines of any slope left out; of two laws it differs
    /// alike.
    #[test]
    fn the_likelihood_is_the_restricted_one() {
        let (x, values) = drawn(&Law::of_white(1.0), 4, 0.01);
        let n = x.len();
        let lines = DMatrix::from_fn(n, 2, |k, j| if j == 0 { 1.0 } else { x[k] });
        let dense = |white: f64, correlated: f64, length: f64| {
            let covariance = DMatrix::from_fn(n, n, |i, j| {
                let own = if i == j { white } else { 0.0 };
                own + correlated * (-(x[i] - x[j]).abs() / length).exp()
            });
            let inverse = covariance.clone().try_inverse().unwrap();
            let normal = lines.transpose() * &inverse * &lines;
            let beside = &inverse
                - &inverse
                    * &lines
                    * normal.clone().try_inverse().unwrap()
                    * lines.transpose()
                    * &inverse;
            let quadratic: f64 = values
                .rows
                .iter()
                .map(|(_, row)| {
                    let row = DVector::from_column_slice(row);
                    row.dot(&(&beside * &row))
                })
                .sum();
            let rows = values.rows.len() as f64;
            let log = rows * (covariance.determinant().ln() + normal.determinant().ln());
            let count = values.count() as f64;
            (0.5 * (count * (quadratic / count).ln() + log), quadratic)
        };
        let of = |white, correlated, length| {
            values.likelihoods(white, correlated, length, &[OfWhole::default()])[0]
        };
        let (first, second) = (of(1.0, 0.0, 1.0), of(0.6, 0.4, 11.0));
        let (one, other) = (dense(1.0, 0.0, 1.0), dense(0.6, 0.4, 11.0));
        // What the greatest lines leave out: their variance is known to 1 in 10⁸ of the noise of sixty readings.
        assert!(
            (first.quadratic / one.1 - 1.0).abs() < 1e-6,
            "{} {}",
            first.quadratic,
            one.1
        );
        assert!((second.quadratic / other.1 - 1.0).abs() < 1e-6);
        let differ = (first.minus_log - second.minus_log) - (one.0 - other.0);
        assert!(differ.abs() < 1e-5, "{differ}");
        // Whatever the slope.
        let (_, steep) = drawn(&Law::of_white(1.0), 4, 0.3);
        let steep = steep.likelihoods(0.6, 0.4, 11.0, &[OfWhole::default()])[0];
        assert!((steep.quadratic / second.quadratic - 1.0).abs() < 1e-4);
    }

    /// *Simulated truth*: correlated noise is told from white noise. Of 30 sets of three rows each.
    #[test]
    fn correlated_noise_is_likelier_than_white_noise_where_it_is_there() {
        let law = Law {
            white: 0.5,
            correlated: 0.5,
            length: 15.0,
            shift: 0.0,
            drift: 0.0,
        };
        let told = |law: &Law| {
            let each = (0..30).filter(|seed| {
                let posterior = Posterior::of(&drawn(law, *seed, 0.0).1).unwrap();
                posterior.correlated() > 0.5
            });
            each.count()
        };
        let (there, not) = (told(&law), told(&Law::of_white(1.0)));
        // As many as not are right by even odds at least; more than eight of 30 wrong have 0.3 % at odds of one in eight.
        assert!(there >= 25, "{there}");
        assert!(not <= 8, "{not}");
    }
}
