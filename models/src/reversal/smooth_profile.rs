//! A measured profile as a smooth function with derivatives: the natural cubic smoothing spline
//! with its weight chosen by generalised cross-validation.
//!
//! Green and Silverman, Nonparametric Regression and Generalized Linear Models (1994), chapter 2;
//! the basis that makes every weight cheap is that of Demmler and Reinsch (1975).

use std::sync::Arc;

use errsep_solvers::linear::limited::symmetric_eigen;
use nalgebra::{DMatrix, DVector};

/// The smoother of one set of positions: found once, used for every profile over them.
#[derive(Debug, Clone)]
pub struct Smoother {
    /// Columns: the Demmler–Reinsch basis.
    basis: Arc<DMatrix<f64>>,
    roughness: Arc<DVector<f64>>,
    /// Between neighbouring positions.
    gaps: Arc<Vec<f64>>,
}

/// A smooth profile at its positions.
#[derive(Debug, Clone)]
pub struct SmoothProfile {
    /// Values.
    pub values: DVector<f64>,
    /// First derivatives, unit of the values per unit of the positions.
    pub slopes: DVector<f64>,
    /// Weight of the roughness against the misfit; zero passes through the values.
    weight: f64,
}

impl SmoothProfile {
    /// Nothing over a number of positions.
    pub fn zero(positions: usize) -> Self {
        Self {
            values: DVector::zeros(positions),
            slopes: DVector::zeros(positions),
            weight: 0.0,
        }
    }

    /// The value at a spot by the cubic between neighbours; straight beyond the ends.
    pub fn at(&self, spot: &Spot) -> f64 {
        let Spot {
            left, right, of, ..
        } = *spot;
        of[0] * self.values[left]
            + of[1] * self.values[right]
            + of[2] * self.slopes[left]
            + of[3] * self.slopes[right]
    }

    /// The slope at a spot, between those at its neighbours.
    pub fn slope_at(&self, spot: &Spot) -> f64 {
        self.slopes[spot.left] * (1.0 - spot.part) + self.slopes[spot.right] * spot.part
    }
}

/// Where a position lies among those of the profiles: the neighbours, and the parts of their values and
/// slopes in the cubic between them (Hermite). One spot serves every profile over the same positions.
#[derive(Debug, Clone, Copy)]
pub struct Spot {
    left: usize,
    right: usize,
    of: [f64; 4],
    /// The part of the way from left to right.
    part: f64,
}

/// Positions that are tried one by one before halving.
const NEARBY: usize = 6;

/// The first of rising positions that is not before one, sought from a neighbour on, by halving where it is far
/// from there.
pub(super) fn first_not_before(positions: &[f64], near: usize, x: f64) -> usize {
    let n = positions.len();
    let mut right = near.min(n);
    for _ in 0..NEARBY {
        if right < n && positions[right] < x {
            right += 1;
        } else if right > 0 && positions[right - 1] >= x {
            right -= 1;
        } else {
            return right;
        }
    }
    positions.partition_point(|p| *p < x)
}

impl Spot {
    /// The spot of a position, sought from a neighbour on.
    pub fn new(positions: &[f64], near: usize, x: f64) -> Self {
        let n = positions.len();
        let right = first_not_before(positions, near, x);
        if right == 0 || right >= n {
            let end = if right == 0 { 0 } else { n - 1 };
            return Self {
                left: end,
                right: end,
                of: [1.0, 0.0, x - positions[end], 0.0],
                part: 0.0,
            };
        }
        let left = right - 1;
        let h = positions[right] - positions[left];
        let t = (x - positions[left]) / h;
        let u = 1.0 - t;
        Self {
            left,
            right,
            of: [
                u * u * (1.0 + 2.0 * t),
                t * t * (1.0 + 2.0 * u),
                h * t * u * u,
                -h * t * t * u,
            ],
            part: t,
        }
    }
}

impl Smoother {
    /// The smoother over strictly increasing positions, or `None` for fewer than four of them.
    pub fn new(positions: &[f64]) -> Option<Self> {
        let n = positions.len();
        if n < 4 || positions.windows(2).any(|w| w[1] <= w[0]) {
            return None;
        }
        let gaps: Vec<f64> = positions.windows(2).map(|w| w[1] - w[0]).collect();
        let mut differences = DMatrix::zeros(n, n - 2);
        let mut gram = DMatrix::zeros(n - 2, n - 2);
        for j in 0..n - 2 {
            for (k, weight) in second_difference(&gaps, j).into_iter().enumerate() {
                differences[(j + k, j)] = weight;
            }
            gram[(j, j)] = (gaps[j] + gaps[j + 1]) / 3.0;
            if j + 1 < n - 2 {
                gram[(j, j + 1)] = gaps[j + 1] / 6.0;
                gram[(j + 1, j)] = gaps[j + 1] / 6.0;
            }
        }
        let curvature = gram.cholesky()?.solve(&differences.transpose());
        let eigen = symmetric_eigen(&differences * &curvature)?;
        Some(Self {
            basis: Arc::new(eigen.eigenvectors),
            roughness: Arc::new(eigen.eigenvalues.map(|v| v.max(0.0))),
            gaps: Arc::new(gaps),
        })
    }

    /// The smooth profile that generalised cross-validation prefers.
    pub fn smooth(&self, values: &DVector<f64>) -> SmoothProfile {
        let n = values.len();
        let coefficients = self.basis.tr_mul(values);
        // Two directions (the straight lines) have no roughness; eigenvalues that rounding
        // leaves there are far below this.
        let top = self.roughness.max();
        let mut best = (f64::INFINITY, 0.0);
        for weight in weights(top) {
            let (mut rss, mut left) = (0.0, 0.0);
            for (c, d) in coefficients.iter().zip(self.roughness.iter()) {
                let shrunk = weight * d / (1.0 + weight * d);
                rss += (c * shrunk).powi(2);
                left += shrunk;
            }
            let score = n as f64 * rss / (left * left).max(f64::MIN_POSITIVE);
            if score < best.0 {
                best = (score, weight);
            }
        }
        self.smoothed(&coefficients, best.1)
    }

    /// The smooth mean of repeated profiles with the weight by which the mean of the others predicts
    /// each of them best. Generalised cross-validation takes noise that is correlated along the
    /// profile for form; between repeats that noise is independent. One repeat falls back on it.
    pub fn smooth_repeated(&self, mean: &DVector<f64>, repeats: &[&DVector<f64>]) -> SmoothProfile {
        if repeats.len() < 2 {
            return self.smooth(mean);
        }
        let count = repeats.len() as f64;
        let own: Vec<DVector<f64>> = repeats.iter().map(|r| self.basis.tr_mul(r)).collect();
        let whole = own
            .iter()
            .fold(DVector::zeros(mean.len()), |sum, c| sum + c);
        // Σ (c − k·rest)² over the repeats as squares and products that no weight changes.
        let sums: Vec<(f64, f64, f64)> = (0..mean.len())
            .map(|d| {
                own.iter().fold((0.0, 0.0, 0.0), |(cc, cr, rr), c| {
                    let (c, rest) = (c[d], whole[d] - c[d]);
                    (cc + c * c, cr + c * rest, rr + rest * rest)
                })
            })
            .collect();
        let missed = |weight: f64| -> f64 {
            sums.iter()
                .zip(self.roughness.iter())
                .map(|((cc, cr, rr), d)| {
                    let k = 1.0 / ((count - 1.0) * (1.0 + weight * d));
                    cc - 2.0 * k * cr + k * k * rr
                })
                .sum()
        };
        let top = self.roughness.max();
        let (_, weight) = weights(top).map(|weight| (missed(weight), weight)).fold(
            (f64::INFINITY, 0.0),
            |best, next| {
                if next.0 < best.0 { next } else { best }
            },
        );
        self.smoothed(&self.basis.tr_mul(mean), weight)
    }

    /// The profile of other values, as smooth as a given one: with R and Q of the natural spline and
    /// w its weight, (R + w QᵀQ) γ = Qᵀy and g = y − w Q γ (Reinsch's algorithm), linear in the positions.
    pub fn smooth_as(&self, profile: &SmoothProfile, values: &DVector<f64>) -> SmoothProfile {
        let weight = profile.weight;
        if weight == 0.0 {
            return self.through(values.clone());
        }
        let curvatures = self.curvatures(values, weight);
        let mut smooth = values.clone();
        for j in 0..self.gaps.len() - 1 {
            for (k, of) in second_difference(&self.gaps, j).into_iter().enumerate() {
                smooth[j + k] -= weight * of * curvatures[j + 1];
            }
        }
        SmoothProfile {
            slopes: self.slopes(&smooth, &curvatures),
            values: smooth,
            weight,
        }
    }

    /// A draw of what smoothing as strong as a given profile's may have taken away of the form. A component of
    /// the basis kept by a part k has the posterior variance kσ² (Wahba, Journal of the Royal
    /// Statistical Society B 45 (1983) 133), of which the noise that is kept makes k²σ²; the rest,
    /// k(1 − k)σ², is form that was taken for noise. `noise`: that of the values, drawn anew.
    pub fn smoothed_away(&self, profile: &SmoothProfile, noise: &DVector<f64>) -> DVector<f64> {
        let draw = self.basis.tr_mul(noise).zip_map(&self.roughness, |c, d| {
            let kept = 1.0 / (1.0 + profile.weight * d);
            (kept * (1.0 - kept)).sqrt() * c
        });
        &*self.basis * draw
    }

    /// The profile with such a draw added.
    pub fn roughened(&self, profile: &SmoothProfile, away: &DVector<f64>) -> SmoothProfile {
        SmoothProfile {
            weight: profile.weight,
            ..self.through(&profile.values + away)
        }
    }

    fn smoothed(&self, coefficients: &DVector<f64>, weight: f64) -> SmoothProfile {
        let kept = coefficients.zip_map(&self.roughness, |c, d| c / (1.0 + weight * d));
        SmoothProfile {
            weight,
            ..self.through(&*self.basis * kept)
        }
    }

    /// The natural cubic spline through given values.
    pub fn through(&self, values: DVector<f64>) -> SmoothProfile {
        let curvatures = self.curvatures(&values, 0.0);
        SmoothProfile {
            slopes: self.slopes(&values, &curvatures),
            values,
            weight: 0.0,
        }
    }

    /// Second derivatives of the smoothing spline of a weight at all positions, none at the ends: the
    /// band R + w QᵀQ is decomposed as L D Lᵀ while it is made.
    fn curvatures(&self, values: &DVector<f64>, weight: f64) -> Vec<f64> {
        let gaps = &self.gaps;
        let n = values.len();
        let mut solved = vec![0.0; n];
        // Of each row the pivot and the multipliers one and two below it.
        let mut factor = vec![[0.0; 3]; n];
        for j in 0..n - 2 {
            let own = second_difference(gaps, j);
            let mut right: f64 = (0..3).map(|k| own[k] * values[j + k]).sum();
            let square = |other: [f64; 3], apart: usize| -> f64 {
                (apart..3).map(|k| own[k] * other[k - apart]).sum()
            };
            let mut pivot = (gaps[j] + gaps[j + 1]) / 3.0 + weight * square(own, 0);
            let mut next = gaps[j + 1] / 6.0;
            if weight > 0.0 && j + 1 < n - 2 {
                next += weight * square(second_difference(gaps, j + 1), 1);
            }
            let mut second = 0.0;
            if weight > 0.0 && j + 2 < n - 2 {
                second = weight * square(second_difference(gaps, j + 2), 2);
            }
            if j >= 1 {
                let [above, first, skip] = factor[j - 1];
                pivot -= above * first * first;
                next -= above * first * skip;
                right -= first * solved[j];
            }
            if j >= 2 {
                let [above, _, skip] = factor[j - 2];
                pivot -= above * skip * skip;
                right -= skip * solved[j - 1];
            }
            second /= pivot;
            factor[j] = [pivot, next / pivot, second];
            solved[j + 1] = right;
        }
        for j in (0..n - 2).rev() {
            let [pivot, first, second] = factor[j];
            let mut value = solved[j + 1] / pivot;
            if j + 1 < n - 2 {
                value -= first * solved[j + 2];
            }
            if j + 2 < n - 2 {
                value -= second * solved[j + 3];
            }
            solved[j + 1] = value;
        }
        solved
    }

    /// First derivatives of the spline of given values and second derivatives.
    fn slopes(&self, values: &DVector<f64>, curvatures: &[f64]) -> DVector<f64> {
        let n = values.len();
        let mut slopes = DVector::zeros(n);
        for k in 0..n - 1 {
            let h = self.gaps[k];
            let chord = (values[k + 1] - values[k]) / h;
            slopes[k] = chord - h * (2.0 * curvatures[k] + curvatures[k + 1]) / 6.0;
            if k + 2 == n {
                slopes[k + 1] = chord + h * (curvatures[k] + 2.0 * curvatures[k + 1]) / 6.0;
            }
        }
        slopes
    }
}

/// The weights of three neighbouring values, from the j-th on, in their second difference.
fn second_difference(gaps: &[f64], j: usize) -> [f64; 3] {
    let (left, right) = (1.0 / gaps[j], 1.0 / gaps[j + 1]);
    [left, -left - right, right]
}

/// The weights to choose from, the greatest eigenvalue of the roughness given.
fn weights(top: f64) -> impl Iterator<Item = f64> {
    (0..=60).map(move |step| 10f64.powf(-6.0 + 0.3 * f64::from(step)) / top)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn follows_a_wave_and_its_slope_through_noise() {
        let x: Vec<f64> = (0..120).map(|k| f64::from(k) * 2.5).collect();
        let wave = |t: f64| (t / 20.0).sin();
        let noisy = DVector::from_iterator(
            x.len(),
            x.iter()
                .enumerate()
                .map(|(k, &t)| wave(t) + 0.01 * (7919.0 * (k * k) as f64).sin()),
        );
        let profile = Smoother::new(&x).unwrap().smooth(&noisy);
        for k in 5..115 {
            // k·u: three standard deviations of the noise, and of its slope over a few positions.
            assert!((profile.values[k] - wave(x[k])).abs() < 0.03);
            assert!((profile.slopes[k] - (x[k] / 20.0).cos() / 20.0).abs() < 0.004);
        }
    }

    /// Noise that is alike over ten neighbours passes for form in one profile, not between four.
    #[test]
    fn repeats_tell_form_from_correlated_noise() {
        let x: Vec<f64> = (0..150).map(f64::from).collect();
        let form = |t: f64| (t / 20.0).sin();
        let noise =
            |k: usize, r: usize| 0.1 * (1.3 * (k / 10) as f64 * (r + 1) as f64 + r as f64).sin();
        let repeats: Vec<DVector<f64>> = (0..4)
            .map(|r| DVector::from_fn(150, |k, _| form(x[k]) + noise(k, r)))
            .collect();
        let mean = repeats.iter().fold(DVector::zeros(150), |sum, r| sum + r) / 4.0;
        let smoother = Smoother::new(&x).unwrap();
        let error = |p: &SmoothProfile| -> f64 {
            (5..145)
                .map(|k| (p.slopes[k] - (x[k] / 20.0).cos() / 20.0).powi(2))
                .sum()
        };
        let own: Vec<&DVector<f64>> = repeats.iter().collect();
        let (single, repeated) = (
            smoother.smooth(&mean),
            smoother.smooth_repeated(&mean, &own),
        );
        assert!(
            error(&repeated) < 0.5 * error(&single),
            "{} {}",
            error(&repeated),
            error(&single)
        );
    }

    /// Forms of the law that a weight stands for (Gaussian, variance of a component one over weight
    /// and roughness), noise of one: what smoothing misses of the slopes is as great as what the
    /// draws miss, and far greater than what the noise that is kept moves them (four times on a line
    /// without end; a spacing cuts the shortest waves off).
    #[test]
    fn draws_are_as_far_off_as_the_smoothing() {
        let n = 120;
        let x: Vec<f64> = (0..n).map(|k| k as f64).collect();
        let smoother = Smoother::new(&x).unwrap();
        let top = smoother.roughness.max();
        let weight = 1e3 / top;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut normal = || DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random));
        let (mut missed, mut drawn, mut kept) = (0.0, 0.0, 0.0);
        for _ in 0..400 {
            let form: DVector<f64> = normal().zip_map(&smoother.roughness, |z: f64, d| {
                if d > 1e-9 * top {
                    z / (weight * d).sqrt()
                } else {
                    0.0
                }
            });
            let truth = smoother.through(&*smoother.basis * &form);
            let profile = smoother.smoothed(&(form + normal()), weight);
            missed += (profile.slopes - truth.slopes).norm_squared();
            let noise = smoother.smoothed(&normal(), weight);
            kept += noise.slopes.norm_squared();
            let away = smoother.smoothed_away(&noise, &normal());
            drawn += smoother.roughened(&noise, &away).slopes.norm_squared();
        }
        // k·u: 400 forms of some twenty components each, √(2/8000) = 1.6 % a sum.
        assert!((drawn / missed - 1.0).abs() < 0.1, "{drawn} {missed}");
        assert!(
            missed > 2.5 * kept && missed < 4.5 * kept,
            "{missed} {kept}"
        );
    }

    /// The place among the positions is that of a search by halving, evenly spaced or not, also outside them
    /// and for what is no number.
    /// Wherever it is sought from, a spot lies where halving finds it.
    #[test]
    fn a_spot_is_found_from_any_neighbour() {
        let even: Vec<f64> = (0..12).map(|k| f64::from(k) * 1.5).collect();
        let uneven: Vec<f64> = even.iter().map(|t| (0.3 * t).exp()).collect();
        for positions in [even, uneven] {
            let n = positions.len();
            let between = (-20..20_000).step_by(7).map(|k| 0.01 * f64::from(k) - 1.5);
            for x in between.chain(positions.iter().copied()) {
                let right = positions.partition_point(|p| *p < x);
                let ends = match right {
                    0 => (0, 0),
                    right if right == n => (n - 1, n - 1),
                    right => (right - 1, right),
                };
                for near in [0, n / 2, n, 10 * n] {
                    let spot = Spot::new(&positions, near, x);
                    assert_eq!((spot.left, spot.right), ends, "{x} from {near}");
                }
            }
        }
    }

    /// The band solves what the basis decomposes.
    #[test]
    fn a_weight_in_the_band_is_that_in_the_basis() {
        let x: Vec<f64> = (0..90)
            .map(|k| f64::from(k) + 0.3 * f64::from(k % 3))
            .collect();
        let smoother = Smoother::new(&x).unwrap();
        let values = DVector::from_fn(90, |k, _| (0.2 * x[k]).sin() + (7919.0 * x[k]).cos());
        let coefficients = smoother.basis.tr_mul(&values);
        let top = smoother.roughness.max();
        for weight in [0.0, 1e-3 / top, 1.0 / top, 1e4 / top, 1e8 / top] {
            let dense = smoother.smoothed(&coefficients, weight);
            let banded = smoother.smooth_as(&dense, &values);
            // Epsilons, times the condition of QᵀQ (90⁴).
            assert!((&dense.values - &banded.values).amax() < 1e-8, "{weight}");
            assert!((&dense.slopes - &banded.slopes).amax() < 1e-8, "{weight}");
        }
    }

    #[test]
    fn a_straight_line_is_left_alone() {
        let x = [0.0, 1.0, 2.5, 3.0, 7.0, 8.0];
        let line = DVector::from_iterator(6, x.iter().map(|t| 3.0 - 0.5 * t));
        let profile = Smoother::new(&x).unwrap().smooth(&line);
        // Epsilons, times the condition of the eigenvectors.
        assert!((profile.values - line).amax() < 1e-9);
        assert!(profile.slopes.iter().all(|s| (s + 0.5).abs() < 1e-9));
    }
}
