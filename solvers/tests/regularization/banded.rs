//! The banded way against the dense one on the same system: everything must agree.

use errsep_solvers::regularization::{
    BandedSystem, Combination, Decomposition, Family, Penalty, RegularizationError, gcv, l_curve,
};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const BAND: usize = 30;
const WIDTH: usize = 4;

struct Pair {
    banded: BandedSystem,
    dense: DMatrix<f64>,
    data: DVector<f64>,
    /// Orthonormal basis of the unknowns that meet the conditions.
    section: DMatrix<f64>,
}

fn pair(penalty: &Penalty, border: usize, conditions: usize) -> Pair {
    let mut generator = ChaCha8Rng::seed_from_u64(11);
    let mut number = || generator.random_range(-1.0..1.0);
    let mut banded = BandedSystem::new(BAND, WIDTH, border, penalty).expect("valid sizes");
    let rows = 2 * (BAND - WIDTH + 1);
    let mut dense = DMatrix::zeros(rows, BAND + border);
    let mut data = DVector::zeros(rows);
    for row in 0..rows {
        let first = row / 2;
        let values: Vec<f64> = (0..WIDTH).map(|_| number()).collect();
        let beside: Vec<f64> = (0..border).map(|_| number()).collect();
        let signal: f64 = values
            .iter()
            .enumerate()
            .map(|(j, v)| v * (0.3 * (first + j) as f64).sin())
            .sum();
        data[row] = signal + 0.3 * number();
        banded
            .push(first, &values, &beside, data[row])
            .expect("in order");
        for (j, value) in values.iter().enumerate() {
            dense[(row, first + j)] = *value;
        }
        for (j, value) in beside.iter().enumerate() {
            dense[(row, BAND + j)] = *value;
        }
    }
    let mut taken = DMatrix::zeros(BAND + border, BAND + border);
    for k in 0..conditions {
        let weights: Vec<f64> = (0..BAND).map(|_| number()).collect();
        for (i, weight) in weights.iter().enumerate() {
            taken[(i, k)] = *weight;
        }
        banded.require(weights).expect("one weight an unknown");
    }
    let basis = taken.qr().q();
    let section = basis
        .columns(conditions, BAND + border - conditions)
        .into_owned();
    Pair {
        banded,
        dense,
        data,
        section,
    }
}

fn cases() -> impl Iterator<Item = (Penalty, usize, usize)> {
    [
        Penalty::Identity,
        Penalty::FirstDifference,
        Penalty::SecondDifference,
    ]
    .into_iter()
    .flat_map(|penalty| {
        [(0, 0), (2, 0), (0, 2), (3, 3)]
            .map(|(border, conditions)| (penalty.clone(), border, conditions))
    })
}

fn decompose(pair: &Pair, penalty: &Penalty, border: usize) -> Decomposition {
    let l = penalty.matrix(BAND).resize_horizontally(BAND + border, 0.0);
    let penalty = Penalty::Custom(l * &pair.section);
    Decomposition::general(&(&pair.dense * &pair.section), &penalty).expect("well posed")
}

/// Epsilons: two orthogonal routes to the norms and solution of a system with a condition number
/// of about 1e3.
#[test]
fn norms_and_solutions_agree_with_the_dense_way() {
    for (penalty, border, conditions) in cases() {
        let pair = pair(&penalty, border, conditions);
        let decomposition = decompose(&pair, &penalty, border);
        let spectrum = decomposition.with_data(&pair.data).expect("finite");
        for lambda in [1e-3, 0.05, 0.7, 5.0] {
            let label = format!("{penalty:?} border {border} conditions {conditions} λ {lambda}");
            let factored = pair.banded.factor(lambda).expect("determined");
            let expected = &pair.section * spectrum.solution(lambda).expect("positive");
            let found = DVector::from_column_slice(factored.solution());
            assert!(
                (&found - &expected).amax() < 1e-10 * expected.amax(),
                "{label}"
            );
            let (a, b) = (
                pair.banded.point(lambda).expect("determined"),
                spectrum.point(lambda).expect("positive"),
            );
            for (name, a, b) in [
                ("residual norm", a.residual_norm, b.residual_norm),
                ("seminorm", a.seminorm, b.seminorm),
                ("slope", a.seminorm_sq_slope, b.seminorm_sq_slope),
                (
                    "effective parameters",
                    a.effective_parameters,
                    b.effective_parameters,
                ),
            ] {
                assert!(
                    (a - b).abs() < 1e-9 * b.abs().max(1e-6),
                    "{label} {name}: {a} {b}"
                );
            }
        }
    }
}

/// Truncation: the banded way takes the derivative by λ as a central difference, good to 1e-6.
#[test]
fn variances_and_biases_agree_with_the_dense_way() {
    for (penalty, border, conditions) in cases() {
        let pair = pair(&penalty, border, conditions);
        let decomposition = decompose(&pair, &penalty, border);
        let spectrum = decomposition.with_data(&pair.data).expect("finite");
        let lambda = 0.3;
        let dense = spectrum.uncertainty(lambda, 1.0).expect("positive");
        let factored = pair.banded.factor(lambda).expect("determined");
        let combinations: Vec<Combination> = [0, 7, BAND - WIDTH]
            .into_iter()
            .map(|first| Combination {
                first,
                band: vec![0.5, -1.0, 0.25, 2.0],
                border: (0..border).map(|j| 1.0 - j as f64).collect(),
            })
            .collect();
        let (variances, biases) = factored.variances(&combinations).expect("determined");
        for (k, w) in combinations.iter().enumerate() {
            let mut weights = DVector::zeros(BAND + border);
            weights.rows_mut(w.first, WIDTH).copy_from_slice(&w.band);
            weights.rows_mut(BAND, border).copy_from_slice(&w.border);
            let weights = pair.section.transpose() * weights;
            let variance = (weights.transpose() * &dense.covariance * &weights)[(0, 0)];
            let bias = (weights.transpose() * &dense.pull).norm();
            assert!(
                (variances[k] - variance).abs() < 1e-5 * variance,
                "{penalty:?} {border}"
            );
            assert!(
                (biases[k] - bias).abs() < 1e-5 * bias,
                "{penalty:?} {border}"
            );
        }
        let expected = &pair.section * &dense.bias_estimate;
        let found = DVector::from_vec(factored.bias_estimate());
        assert!((found - &expected).amax() < 1e-9 * expected.amax());
    }
}

/// The rules see only norms, so they must choose alike wherever the ranges overlap: the corner to
/// the width of the refinement.
#[test]
fn rules_choose_alike() {
    let penalty = Penalty::Identity;
    let pair = pair(&penalty, 2, 0);
    let decomposition = decompose(&pair, &penalty, 2);
    let spectrum = decomposition.with_data(&pair.data).expect("finite");
    let corners = [
        l_curve(&pair.banded).expect("has a range"),
        l_curve(&spectrum).expect("has a range"),
    ];
    assert_eq!(corners[0].status, corners[1].status);
    let a = gcv(&pair.banded).expect("has a range");
    let b = gcv(&spectrum).expect("has a range");
    assert!(!a.at_edge && !b.at_edge);
    assert!((a.point.lambda / b.point.lambda - 1.0).abs() < 0.01);
    assert!((a.value - b.value).abs() < 1e-6 * b.value);
}

#[test]
fn rows_that_do_not_fit_are_refused() {
    let mut system = BandedSystem::new(6, 3, 1, &Penalty::Identity).expect("valid sizes");
    let shape = |result: Result<(), RegularizationError>| {
        assert!(
            matches!(result, Err(RegularizationError::Shape { .. })),
            "{result:?}"
        );
    };
    shape(system.push(0, &[1.0; 2], &[0.0], 0.0));
    shape(system.push(0, &[1.0; 3], &[], 0.0));
    shape(system.push(4, &[1.0; 3], &[0.0], 0.0));
    assert_eq!(system.push(2, &[1.0; 3], &[0.0], 0.0), Ok(()));
    shape(system.push(1, &[1.0; 3], &[0.0], 0.0));
    let not_a_number = system.push(2, &[1.0, f64::NAN, 1.0], &[0.0], 0.0);
    assert!(matches!(
        not_a_number,
        Err(RegularizationError::NotFinite { .. })
    ));
    shape(system.require(vec![1.0; 7]));
    // The border is never seen: no λ determines it.
    assert!(matches!(
        system.factor(1.0).map(|_| ()),
        Err(RegularizationError::SharedNullSpace { dimension: 1 })
    ));
    assert!(BandedSystem::new(6, 3, 0, &Penalty::Custom(DMatrix::identity(6, 6))).is_err());
}
