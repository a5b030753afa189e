//! The restricted maximum likelihood against its definition, on data drawn as it assumes, and where it
//! has nothing to find.

use errsep_solvers::regularization::{Decomposition, Family, Penalty, likelihood};
use errsep_standard_problems::ill_posed as problems;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn white(length: usize, seed: u64) -> DVector<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    DVector::from_fn(length, |_, _| StandardNormal.sample(&mut generator))
}

/// 40 readings of 12 unknowns, well to badly seen.
fn matrix() -> DMatrix<f64> {
    DMatrix::from_fn(40, 12, |i, j| {
        (-(i as f64 - 3.3 * j as f64).powi(2) / 40.0).exp()
    })
}

/// Half of −2 ln of the restricted likelihood, σ profiled out, by the covariance itself:
/// ln det V + ln det NᵀV⁻¹N + (m − n₀) ln bᵀPb with V = I + A L⁺L⁺ᵀAᵀ/λ² and N = A null(L).
fn by_definition(a: &DMatrix<f64>, l: &DMatrix<f64>, b: &DVector<f64>, lambda: f64) -> f64 {
    let m = a.nrows();
    let pseudo = l.clone().pseudo_inverse(1e-12).unwrap();
    let half = a * pseudo / lambda;
    let v = DMatrix::identity(m, m) + &half * half.transpose();
    let inverse = v.clone().try_inverse().unwrap();
    // The null space of L from a full decomposition of LᵀL.
    let eigen = (l.transpose() * l).symmetric_eigen();
    let free: Vec<DVector<f64>> = (0..l.ncols())
        .filter(|&k| eigen.eigenvalues[k] < 1e-10)
        .map(|k| eigen.eigenvectors.column(k).into_owned())
        .collect();
    let mut log = v.cholesky().unwrap().l().diagonal().map(f64::ln).sum() * 2.0;
    let mut projector = inverse.clone();
    if !free.is_empty() {
        let n = a * DMatrix::from_columns(&free);
        let inner = n.transpose() * &inverse * &n;
        log += inner.determinant().ln();
        projector -= &inverse * &n * inner.try_inverse().unwrap() * n.transpose() * &inverse;
    }
    let q = b.dot(&(projector * b));
    0.5 * (log + (m - free.len()) as f64 * q.ln())
}

#[test]
fn the_minimum_is_that_of_the_definition() {
    let a = matrix();
    let truth = DVector::from_fn(12, |j, _| (0.8 * j as f64).sin() + 0.2 * j as f64);
    let b = &a * truth + 0.05 * white(40, 4);
    for penalty in [
        Penalty::Identity,
        Penalty::FirstDifference,
        Penalty::SecondDifference,
    ] {
        let decomposition = Decomposition::general(&a, &penalty).unwrap();
        let spectrum = decomposition.with_data(&b).unwrap();
        let found = likelihood(&spectrum).unwrap();
        assert!(!found.at_edge, "{penalty:?}");
        let l = penalty.matrix(12);
        let at = |factor: f64| by_definition(&a, &l, &b, factor * found.point.lambda);
        // The definition has its minimum there: both neighbours are higher, and to truncation (a step of
        // 1e-3 in ln λ) its slope is zero.
        let h = 1e-3_f64;
        let slope = (at(h.exp()) - at((-h).exp())) / (2.0 * h);
        assert!(slope.abs() < 1e-5, "{penalty:?} {slope}");
        for factor in [0.5, 0.9, 1.1, 2.0] {
            assert!(at(factor) > at(1.0), "{penalty:?} {factor}");
        }
    }
}

#[test]
fn both_scatters_are_found_where_they_are_as_assumed() {
    let a = problems::deriv2(60).matrix * 30.0;
    let decomposition = Decomposition::standard(&a).unwrap();
    let (sigma, size) = (0.02, 1.5);
    let runs = 40;
    let (mut noise, mut ratio) = (0.0, 0.0);
    for seed in 0..runs {
        let b = &a * (size * white(60, 2 * seed)) + sigma * white(60, 2 * seed + 1);
        let found = likelihood(&decomposition.with_data(&b).unwrap()).unwrap();
        noise += found.noise / sigma / runs as f64;
        ratio += (found.point.lambda / (sigma / size)).ln() / runs as f64;
    }
    // k·u: some 40 of the 60 rows show the noise, σ to 1/√80 a run, 2 % over 40; λ to some 25 % a run
    // from the dozen components that show, 4 % over 40. Three of each.
    assert!((noise - 1.0).abs() < 0.06, "{noise}");
    assert!(ratio.abs() < 0.12, "{ratio}");
}

#[test]
fn pure_noise_wants_the_largest_penalty_and_exact_data_the_smallest() {
    let a = matrix();
    let decomposition = Decomposition::standard(&a).unwrap();
    let exact = &a * DVector::from_element(12, 1.0);
    let found = likelihood(&decomposition.with_data(&exact).unwrap()).unwrap();
    assert!(found.at_edge);
    assert!(found.noise < 1e-3, "{}", found.noise);
    // Noise alone, orthogonal to all that A can make: any signal is too much.
    let noise = white(40, 9);
    let left = &noise - &a * a.clone().pseudo_inverse(1e-12).unwrap() * &noise;
    let spectrum = decomposition.with_data(&(left + 1e-3 * &exact)).unwrap();
    let found = likelihood(&spectrum).unwrap();
    assert!(found.at_edge);
    // Rounding of the grid over ln λ.
    assert!((found.point.lambda / spectrum.range().1 - 1.0).abs() < 1e-12);
}

/// The criterion is −2 ln of the density of b, noise and x drawn with the σ and s found, but for
/// (m) ln 2π and what profiling σ leaves: m − m ln m.
#[test]
fn the_criterion_is_the_density_of_the_data() {
    let (m, n) = (14, 9);
    let a = DMatrix::from_fn(m, n, |i, j| {
        ((i * j) as f64 * 0.7).sin() + f64::from(i == j)
    });
    let b = DVector::from_fn(m, |i, _| {
        (i as f64 * 1.3).cos() + 0.3 * (i as f64 * 5.1).sin()
    });
    let decomposition = Decomposition::general(&a, &Penalty::Identity).unwrap();
    let spectrum = decomposition.with_data(&b).unwrap();
    let found = likelihood(&spectrum).unwrap();
    let variance = found.noise.powi(2);
    let ratio = found.point.lambda.powi(-2);
    let v = (DMatrix::identity(m, m) + &a * a.transpose() * ratio) * variance;
    let factor = v.clone().cholesky().unwrap();
    let density = b.dot(&factor.solve(&b)) + factor.determinant().ln();
    let rows = m as f64;
    let expected = density - rows + rows * rows.ln();
    // Truncation of the trapezoidal rule, h²/12 times the change of the slope of 2 e, at most one a parameter, over
    // steps of h = 3 ln 10/29 above the range.
    let truncation = (3.0 * 10_f64.ln() / 29.0).powi(2) / 12.0 * n as f64;
    assert!(
        (found.criterion - expected).abs() < truncation,
        "{} {expected}",
        found.criterion
    );
}
