//! Regularized least squares: one decomposition against the plain definition, and the rules that
//! choose λ on problems where the right answer is known.

use errsep_solvers::regularization::{
    CornerStatus, Decomposition, Discrepancy, Family, Penalty, RegularizationError, discrepancy,
    gcv, l_curve, l_curve_between, periodogram, whiteness_distance,
};
use errsep_standard_problems::ill_posed as problems;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn white(length: usize, seed: u64) -> DVector<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    DVector::from_fn(length, |_, _| StandardNormal.sample(&mut generator))
}

/// A smooth, moderately ill-conditioned tall problem.
fn tall() -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
    let matrix = DMatrix::from_fn(14, 8, |i, j| {
        (-(i as f64 - 1.7 * j as f64).powi(2) / 12.0).exp()
    });
    let solution = DVector::from_fn(8, |j, _| (0.6 * j as f64).sin() + 0.3);
    let data = &matrix * &solution + 0.01 * white(14, 3);
    (matrix, solution, data)
}

/// min ‖[A; λL]x − [b; 0]‖ by the singular values of the stacked matrix: the definition itself.
fn by_definition(
    matrix: &DMatrix<f64>,
    penalty: &DMatrix<f64>,
    data: &DVector<f64>,
    lambda: f64,
) -> DVector<f64> {
    let (m, p) = (matrix.nrows(), penalty.nrows());
    let mut stacked = matrix.clone().resize_vertically(m + p, 0.0);
    stacked.rows_mut(m, p).copy_from(&(penalty * lambda));
    let right = data.clone().resize_vertically(m + p, 0.0);
    stacked
        .svd(true, true)
        .solve(&right, 1e-14)
        .expect("both factors were computed")
}

fn penalties(unknowns: usize) -> Vec<Penalty> {
    let dependent_rows = DMatrix::from_fn(unknowns + 2, unknowns, |i, j| {
        let i = i % unknowns;
        f64::from(u8::from(i == j)) + 0.4 * f64::from(u8::from(i + 1 == j))
    });
    let few_rows = DMatrix::from_fn(3, unknowns, |i, j| ((i + 1) as f64 * j as f64).cos());
    vec![
        Penalty::Identity,
        Penalty::FirstDifference,
        Penalty::SecondDifference,
        Penalty::Custom(dependent_rows),
        Penalty::Custom(few_rows),
    ]
}

/// Epsilons: two routes to the solution of a system with condition number below 1e4.
#[test]
fn every_penalty_agrees_with_the_stacked_system() {
    let (matrix, _, data) = tall();
    for penalty in penalties(8) {
        let l = penalty.matrix(8);
        let decomposition = Decomposition::general(&matrix, &penalty).expect("well posed");
        let spectrum = decomposition.with_data(&data).expect("finite data");
        for lambda in [1e-3, 0.1, 2.0] {
            let expected = by_definition(&matrix, &l, &data, lambda);
            let found = spectrum.solution(lambda).expect("positive");
            assert!(
                (&found - &expected).amax() < 1e-10 * expected.amax(),
                "{penalty:?} {lambda}"
            );
            let point = spectrum.point(lambda).expect("positive");
            let residuals = &data - &matrix * &expected;
            assert!((point.residual_norm - residuals.norm()).abs() < 1e-10);
            assert!((point.seminorm - (&l * &expected).norm()).abs() < 1e-10 * expected.norm());
            assert!((spectrum.residuals(lambda).expect("positive") - residuals).amax() < 1e-10);
        }
    }
}

/// Epsilons for the trace; truncation for the slope: the error of a central difference with a
/// relative step h is h²/6 of the third derivative, about 1e-8 here.
#[test]
fn trace_and_slope_are_those_of_the_influence_matrix() {
    let (matrix, _, data) = tall();
    for penalty in penalties(8) {
        let l = penalty.matrix(8);
        let decomposition = Decomposition::general(&matrix, &penalty).expect("well posed");
        let spectrum = decomposition.with_data(&data).expect("finite data");
        for lambda in [0.01, 0.3, 1.5] {
            let point = spectrum.point(lambda).expect("positive");
            let normal = matrix.transpose() * &matrix + l.transpose() * &l * lambda * lambda;
            let inverse = normal.try_inverse().expect("positive definite");
            let trace = (&matrix * inverse * matrix.transpose()).trace();
            assert!(
                (point.effective_parameters - trace).abs() < 1e-8,
                "{penalty:?} {lambda}"
            );
            let h = 1e-4 * lambda;
            let at = |lambda: f64| spectrum.point(lambda).expect("positive").seminorm.powi(2);
            let slope = (at(lambda + h) - at(lambda - h)) / (2.0 * h);
            assert!(
                (point.seminorm_sq_slope - slope).abs() < 1e-6 * slope.abs(),
                "{penalty:?} {lambda}"
            );
        }
    }
}

/// Truncation: the curvature from three neighbouring points of the curve, as anyone would draw it.
/// Positive where an L is convex: a sign error would choose the flattest place instead.
#[test]
fn curvature_has_the_sign_and_size_of_the_drawn_curve() {
    let problem = problems::shaw(24);
    let data = &problem.data + 1e-3 * problem.data.amax() * white(24, 8);
    let decomposition = Decomposition::standard(&problem.matrix).expect("finite");
    let spectrum = decomposition.with_data(&data).expect("finite");
    let curve = l_curve(&spectrum).expect("has a range");
    assert_eq!(curve.status, CornerStatus::Corner);
    let corner = curve.lambda().expect("a corner");
    let place = |lambda: f64| {
        let p = spectrum.point(lambda).expect("positive");
        (p.residual_norm.ln(), p.seminorm.ln())
    };
    for lambda in [0.3 * corner, corner, 4.0 * corner, 60.0 * corner] {
        let (a, b, c) = (place(lambda * 1.003), place(lambda), place(lambda / 1.003));
        let cross = (b.0 - a.0) * (c.1 - b.1) - (b.1 - a.1) * (c.0 - b.0);
        let side = |p: (f64, f64), q: (f64, f64)| (p.0 - q.0).hypot(p.1 - q.1);
        // Turning right while λ falls is convex towards the origin.
        let drawn = -2.0 * cross / (side(a, b) * side(b, c) * side(a, c));
        let analytic = spectrum.point(lambda).expect("positive").curvature();
        assert!(
            (drawn - analytic).abs() < 2e-3 * analytic.abs().max(1.0),
            "{drawn} {analytic}"
        );
    }
    assert!(spectrum.point(corner).expect("positive").curvature() > 1.0);
}

/// Epsilons: both parts against their definitions, A# = (AᵀA + λ²LᵀL)⁻¹Aᵀ.
#[test]
fn covariance_and_bias_are_kept_apart_and_exact() {
    let (matrix, solution, _) = tall();
    let clean = &matrix * &solution;
    for penalty in penalties(8) {
        let l = penalty.matrix(8);
        let decomposition = Decomposition::general(&matrix, &penalty).expect("well posed");
        let spectrum = decomposition.with_data(&clean).expect("finite data");
        let lambda = 0.2;
        let normal = matrix.transpose() * &matrix + l.transpose() * &l * lambda * lambda;
        let sharp = normal.try_inverse().expect("positive definite") * matrix.transpose();
        let uncertainty = spectrum.uncertainty(lambda, 0.5).expect("positive");
        let expected = &sharp * sharp.transpose() * 0.25;
        assert!(
            (&uncertainty.covariance - &expected).amax() < 1e-9 * expected.amax(),
            "{penalty:?}"
        );
        let estimate = spectrum.solution(lambda).expect("positive");
        let plug_in = &sharp * &matrix * &estimate - &estimate;
        assert!((&uncertainty.bias_estimate - plug_in).amax() < 1e-9);
        // Without noise the error is all bias, and within its bound for the true ‖Lx‖.
        let bound = uncertainty.bias_bound((&l * &solution).norm());
        for ((found, truth), bound) in estimate.iter().zip(solution.iter()).zip(bound.iter()) {
            assert!(
                (found - truth).abs() <= bound * (1.0 + 1e-9) + 1e-12,
                "{penalty:?}"
            );
        }
    }
}

/// k·u: the mean square error over the noise is the stated variance; with 4000 draws its relative
/// standard error is √(2/4000) = 2.2 %, and 10 % is more than four of them.
#[test]
fn noise_scatters_the_solution_as_stated() {
    let (matrix, solution, _) = tall();
    let clean = &matrix * &solution;
    let decomposition =
        Decomposition::general(&matrix, &Penalty::SecondDifference).expect("well posed");
    let (lambda, noise) = (0.2, 0.05);
    let centre = decomposition
        .with_data(&clean)
        .expect("finite")
        .solution(lambda)
        .expect("positive");
    let mut squares = DVector::zeros(8);
    for seed in 0..4000 {
        let data = &clean + noise * white(14, seed);
        let found = decomposition
            .with_data(&data)
            .expect("finite")
            .solution(lambda)
            .expect("positive");
        squares += (found - &centre).map(|d| d * d) / 4000.0;
    }
    let stated = decomposition
        .with_data(&clean)
        .expect("finite")
        .uncertainty(lambda, noise)
        .expect("positive")
        .standard_deviations();
    for (square, std) in squares.iter().zip(stated.iter()) {
        assert!((square / (std * std) - 1.0).abs() < 0.1);
    }
}

/// Exact limits: all components kept is least squares, none is zero, and each norm is that of its
/// solution.
#[test]
fn truncation_runs_from_nothing_to_least_squares() {
    let (matrix, _, data) = tall();
    let decomposition = Decomposition::standard(&matrix).expect("finite");
    let spectrum = decomposition.with_data(&data).expect("finite");
    assert_eq!(spectrum.truncated(0).norm(), 0.0);
    let least = matrix
        .clone()
        .svd(true, true)
        .solve(&data, 0.0)
        .expect("both factors");
    assert!((spectrum.truncated(8) - &least).amax() < 1e-9 * least.amax());
    for kept in 0..=8 {
        let found = spectrum.truncated(kept);
        let (residual, seminorm) = spectrum.truncated_norms(kept);
        assert!((residual - (&data - &matrix * &found).norm()).abs() < 1e-9);
        assert!((seminorm - found.norm()).abs() < 1e-9 * (1.0 + seminorm));
    }
}

#[test]
fn what_nothing_determines_is_refused_by_name() {
    let (matrix, _, _) = tall();
    // Both ignore a constant added to the first two unknowns.
    let mut blind = matrix.clone();
    let sum = blind.column(0) - blind.column(1);
    blind.set_column(0, &sum);
    blind.set_column(1, &(-&sum));
    let penalty = Penalty::Custom(DMatrix::from_fn(6, 8, |i, j| {
        f64::from(u8::from(i + 2 == j))
    }));
    let refused = Decomposition::general(&blind, &penalty).map(|_| ());
    assert_eq!(
        refused,
        Err(RegularizationError::SharedNullSpace { dimension: 1 })
    );

    let narrow = Penalty::Custom(DMatrix::zeros(2, 5));
    assert!(matches!(
        Decomposition::general(&matrix, &narrow).map(|_| ()),
        Err(RegularizationError::Shape {
            expected: 8,
            found: 5,
            ..
        })
    ));
    let decomposition = Decomposition::standard(&matrix).expect("finite");
    let spectrum = decomposition
        .with_data(&DVector::zeros(14))
        .expect("finite");
    assert!(matches!(
        spectrum.solution(0.0),
        Err(RegularizationError::Lambda { .. })
    ));
    assert!(matches!(
        spectrum.solution(f64::NAN),
        Err(RegularizationError::Lambda { .. })
    ));
    let mut broken = matrix.clone();
    broken[(3, 2)] = f64::NAN;
    assert!(matches!(
        Decomposition::standard(&broken).map(|_| ()),
        Err(RegularizationError::NotFinite { .. })
    ));
}

/// A problem made of its singular values and coefficients alone.
fn diagonal(values: &[f64], coefficients: &[f64]) -> (Decomposition, DVector<f64>) {
    let matrix = DMatrix::from_diagonal(&DVector::from_column_slice(values));
    let decomposition = Decomposition::standard(&matrix).expect("finite");
    (decomposition, DVector::from_column_slice(coefficients))
}

/// One component alone draws a curve that is concave from end to end: there is no corner, and the
/// place of least curvature is not one.
#[test]
fn a_concave_curve_has_no_corner() {
    let (decomposition, data) = diagonal(&[1.0], &[1.0]);
    let spectrum = decomposition.with_data(&data).expect("finite");
    for step in 0..40 {
        let lambda = 10.0_f64.powf(-2.0 + step as f64 / 10.0);
        assert!(spectrum.point(lambda).expect("positive").curvature() < 0.0);
    }
    let curve = l_curve_between(&spectrum, 1e-3, 1.0, 100).expect("has a range");
    assert_eq!(curve.status, CornerStatus::NoCorner);
    assert_eq!(curve.lambda(), None);
}

/// The same curve sampled only to the right of its corner bends most at the end of the range.
#[test]
fn a_corner_beyond_the_range_is_reported_as_such() {
    let problem = problems::shaw(32);
    let data = &problem.data + 1e-3 * problem.data.amax() * white(32, 1);
    let decomposition = Decomposition::standard(&problem.matrix).expect("finite");
    let spectrum = decomposition.with_data(&data).expect("finite");
    let whole = l_curve(&spectrum).expect("has a range");
    let corner = whole.lambda().expect("a corner");
    let (_, largest) = spectrum.range();
    let part = l_curve_between(&spectrum, 1.5 * corner, largest, 60).expect("has a range");
    assert_eq!(part.status, CornerStatus::AtEdge);
    assert_eq!(part.lambda(), None);
    assert!(part.corners[0].point.lambda < 1.6 * corner);
}

/// Two groups of components, each with its own level of noise, bend the curve twice alike: both are
/// reported and the more regularized is taken.
#[test]
fn two_corners_are_both_reported() {
    let (mut values, mut coefficients) = (Vec::new(), Vec::new());
    for k in 0..60 {
        let value = 10.0_f64.powf(-0.2 * k as f64);
        let signal = if k < 6 { value } else { 0.0 };
        let noise = if k < 22 { 3e-3 } else { 1e-8 };
        values.push(value);
        coefficients.push(signal + noise);
    }
    let (decomposition, data) = diagonal(&values, &coefficients);
    let spectrum = decomposition.with_data(&data).expect("finite");
    let curve = l_curve(&spectrum).expect("has a range");
    assert_eq!(curve.status, CornerStatus::MultipleCorners);
    let rivals: Vec<f64> = curve.corners.iter().map(|c| c.point.lambda).collect();
    assert!(
        rivals.len() >= 2 && rivals[0] > 10.0 * rivals[1],
        "{rivals:?}"
    );
    assert_eq!(curve.lambda(), Some(rivals[0]));
}

#[test]
fn discrepancy_says_when_noise_and_data_do_not_fit() {
    let problem = problems::deriv2(32);
    let noise = 0.01 * problem.data.amax();
    let data = &problem.data + noise * white(32, 5);
    let decomposition = Decomposition::standard(&problem.matrix).expect("finite");
    let spectrum = decomposition.with_data(&data).expect("finite");
    let found = discrepancy(&spectrum, noise).expect("positive noise");
    assert!(matches!(found, Discrepancy::Found(_)));
    let larger = discrepancy(&spectrum, 1.3 * noise).expect("positive noise");
    assert!(
        larger.lambda() > found.lambda(),
        "more noise wants more smoothing"
    );
    let buried = discrepancy(&spectrum, 1e3 * noise).expect("positive noise");
    assert!(matches!(buried, Discrepancy::NoiseTooLarge(_)) && buried.lambda().is_none());
    assert!(discrepancy(&spectrum, 0.0).is_err());

    // Data with a part that no solution reaches, and a stated noise far below it.
    let (matrix, _, _) = tall();
    let decomposition = Decomposition::standard(&matrix).expect("finite");
    let spectrum = decomposition.with_data(&white(14, 2)).expect("finite");
    let starved = discrepancy(&spectrum, 1e-6).expect("positive noise");
    assert!(matches!(starved, Discrepancy::NoiseTooSmall(_)) && starved.lambda().is_none());
}

/// Exact limits of the periodogram: one frequency is as far from white as can be, an impulse has
/// even power.
#[test]
fn whiteness_knows_its_extremes() {
    let wave = DVector::from_fn(64, |n, _| {
        (2.0 * std::f64::consts::PI * n as f64 / 64.0).sin()
    });
    assert!(whiteness_distance(&wave) > 0.96);
    let impulse = DVector::from_fn(64, |n, _| f64::from(u8::from(n == 10)));
    assert!(whiteness_distance(&impulse) < 1e-12);
}

/// The rules against the best λ there is, for the median of nine draws: what each factor means is
/// told in the table of docs/validation/regularization.md. The limits are the observed medians with
/// a half to spare, and name what the rule is known for.
#[test]
fn each_rule_comes_near_the_best_parameter_where_it_should() {
    struct Case {
        problem: problems::TestProblem,
        level: f64,
        /// Largest median of error over least error: L-curve, GCV, discrepancy, periodogram.
        limits: [Option<f64>; 4],
    }
    let cases = [
        // Signal and noise well apart: every rule does.
        Case {
            problem: problems::shaw(48),
            level: 1e-2,
            limits: [Some(1.6), Some(1.8), Some(2.5), Some(2.0)],
        },
        Case {
            problem: problems::baart(48),
            level: 1e-3,
            limits: [Some(2.1), Some(2.5), Some(3.0), Some(2.7)],
        },
        Case {
            problem: problems::heat(48),
            level: 1e-1,
            limits: [Some(1.6), Some(1.6), Some(2.2), Some(1.8)],
        },
        Case {
            problem: problems::deriv2(48),
            level: 1e-2,
            limits: [Some(1.8), Some(1.8), Some(1.8), Some(1.8)],
        },
        // Very smooth solution and little noise: the L-curve under-smooths (Hanke 1996), no limit.
        Case {
            problem: problems::gravity(48),
            level: 1e-4,
            limits: [None, Some(2.0), Some(2.0), Some(1.8)],
        },
        Case {
            problem: problems::phillips(48),
            level: 1e-3,
            limits: [None, Some(2.6), Some(1.7), Some(1.7)],
        },
    ];
    for Case {
        problem,
        level,
        limits,
    } in cases
    {
        let n = problem.data.len();
        let decomposition = Decomposition::standard(&problem.matrix).expect("finite");
        let noise = level * problem.data.norm() / (n as f64).sqrt();
        let mut ratios: [Vec<f64>; 4] = Default::default();
        for seed in 100..109 {
            let data = &problem.data + noise * white(n, seed);
            let spectrum = decomposition.with_data(&data).expect("finite");
            let error = |lambda: f64| {
                (spectrum.solution(lambda).expect("positive") - &problem.solution).norm()
            };
            let (smallest, largest) = spectrum.range();
            let best = (0..300)
                .map(|k| error(smallest * (10.0 * largest / smallest).powf(k as f64 / 299.0)))
                .fold(f64::INFINITY, f64::min);
            let lambdas = [
                l_curve(&spectrum).expect("has a range").lambda(),
                Some(gcv(&spectrum).expect("has a range").point.lambda),
                discrepancy(&spectrum, noise)
                    .expect("positive noise")
                    .lambda(),
                Some(periodogram(&spectrum).expect("has a range").lambda),
            ];
            for (ratio, lambda) in ratios.iter_mut().zip(lambdas) {
                ratio.push(lambda.map_or(f64::INFINITY, |lambda| error(lambda) / best));
            }
        }
        for (rule, (ratio, limit)) in ratios.iter_mut().zip(limits).enumerate() {
            ratio.sort_by(f64::total_cmp);
            let median = ratio[4];
            assert!(ratio[0] > 0.99, "no λ beats the best one");
            if let Some(limit) = limit {
                assert!(median < limit, "{} rule {rule}: {median}", problem.name);
            }
        }
    }
}

/// The L-curve's known failure is a failure here too, not silently mended: on a smooth solution with
/// little noise its λ is far too small.
#[test]
fn the_l_curve_under_smooths_a_very_smooth_solution() {
    let problem = problems::gravity(48);
    let noise = 1e-5 * problem.data.norm() / 48.0_f64.sqrt();
    let decomposition = Decomposition::standard(&problem.matrix).expect("finite");
    let data = &problem.data + noise * white(48, 4);
    let spectrum = decomposition.with_data(&data).expect("finite");
    let corner = l_curve(&spectrum)
        .expect("has a range")
        .lambda()
        .expect("a corner");
    let cross = gcv(&spectrum).expect("has a range").point.lambda;
    assert!(corner < 0.2 * cross, "{corner} {cross}");
}
