//! What must not change the answer: units of parameters, order and rotation of residuals.

use errsep_solvers::{Damping, Factorization, Fit, Method, NoValue, Options, Problem, fit};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// y = a exp(−k t) + c with errors, seen through other units and another basis of the residuals.
struct Seen {
    errors: Vec<f64>,
    /// Parameters are given in these units.
    units: [f64; 3],
    /// An orthogonal matrix applied to the residuals.
    rotation: Option<DMatrix<f64>>,
    /// A new order of the residuals.
    order: Vec<usize>,
}

const COUNT: usize = 12;
const TRUTH: [f64; 3] = [2.0, 0.8, 0.5];

impl Seen {
    fn plain(errors: &[f64]) -> Self {
        Self {
            errors: errors.to_vec(),
            units: [1.0; 3],
            rotation: None,
            order: (0..COUNT).collect(),
        }
    }

    fn turned(&self, matrix: DMatrix<f64>) -> DMatrix<f64> {
        let mut ordered = matrix.clone();
        for (to, &from) in self.order.iter().enumerate() {
            ordered.set_row(to, &matrix.row(from));
        }
        match &self.rotation {
            Some(rotation) => rotation * ordered,
            None => ordered,
        }
    }
}

impl Problem for Seen {
    fn parameter_count(&self) -> usize {
        3
    }

    fn residual_count(&self) -> usize {
        COUNT
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let model = |q: &[f64; 3], t: f64| q[0] * (-q[1] * t).exp() + q[2];
        let q = [0, 1, 2].map(|j| p[j] * self.units[j]);
        let plain = DMatrix::from_fn(COUNT, 1, |i, _| {
            let t = 0.4 * i as f64;
            model(&q, t) - model(&TRUTH, t) - self.errors[i]
        });
        Ok(self.turned(plain).column(0).into_owned())
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let q = [0, 1, 2].map(|j| p[j] * self.units[j]);
        let plain = DMatrix::from_fn(COUNT, 3, |i, j| {
            let t = 0.4 * i as f64;
            let decay = (-q[1] * t).exp();
            [decay, -q[0] * t * decay, 1.0][j] * self.units[j]
        });
        Ok(self.turned(plain))
    }
}

fn fitted(problem: &Seen, options: &Options) -> Fit {
    let start = DVector::from_fn(3, |j, _| [1.2, 1.3, 0.1][j] / problem.units[j]);
    let fit = fit(problem, start, options).expect("a good problem");
    assert!(fit.ending.is_converged(), "{}", fit.ending);
    fit
}

fn all_options() -> Vec<Options> {
    let mut all = Vec::new();
    for method in [
        Method::GaussNewton,
        Method::Dogleg,
        Method::LevenbergMarquardt(Damping::More),
        Method::LevenbergMarquardt(Damping::Nielsen),
    ] {
        for factorization in [Factorization::Qr, Factorization::Svd] {
            all.push(Options {
                factorization,
                ..Options::with_method(method)
            });
        }
    }
    all
}

/// epsilons: residuals of ε through condition numbers of some tens.
const ROUNDING: f64 = 1e-12;

fn same(one: &Fit, other: &Fit, units: [f64; 3]) -> bool {
    let covariances = (one.covariance(), other.covariance());
    (0..3).all(|j| {
        let value = other.parameters[j] * units[j];
        let uncertainty = covariances.1.standard_uncertainty(j) * units[j];
        (value / one.parameters[j] - 1.0).abs() <= ROUNDING
            && (uncertainty / covariances.0.standard_uncertainty(j) - 1.0).abs() <= ROUNDING
    }) && (other.cost / one.cost - 1.0).abs() <= ROUNDING
}

fn errors() -> impl proptest::strategy::Strategy<Value = Vec<f64>> {
    proptest::collection::vec(-0.05..0.05_f64, COUNT)
}

fn rotation(seed: u64) -> DMatrix<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    DMatrix::from_fn(COUNT, COUNT, |_, _| generator.random_range(-1.0..1.0))
        .qr()
        .q()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn units_do_not_matter(errors in errors(), powers in [-6.0..6.0_f64, -6.0..6.0, -6.0..6.0]) {
        let plain = Seen::plain(&errors);
        let units = powers.map(|power| 10f64.powf(power));
        let scaled = Seen { units, ..Seen::plain(&errors) };
        for options in all_options() {
            let pair = (fitted(&plain, &options), fitted(&scaled, &options));
            prop_assert!(same(&pair.0, &pair.1, units), "{:?}", options.method);
        }
    }

    /// Powers of two round nothing, so that not only the end but every step must be the same.
    #[test]
    fn units_do_not_change_the_way(errors in errors(), powers in [-20..20_i32, -20..20, -20..20]) {
        let plain = Seen::plain(&errors);
        let scaled = Seen { units: powers.map(|power| 2f64.powi(power)), ..Seen::plain(&errors) };
        for options in all_options() {
            let pair = (fitted(&plain, &options), fitted(&scaled, &options));
            prop_assert_eq!(pair.0.iterations, pair.1.iterations, "{:?}", options.method);
        }
    }

    #[test]
    fn order_does_not_matter(errors in errors(), seed in 0..1000_u64) {
        let plain = Seen::plain(&errors);
        let mut shuffled = Seen::plain(&errors);
        shuffled.order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        for options in all_options() {
            let pair = (fitted(&plain, &options), fitted(&shuffled, &options));
            prop_assert!(same(&pair.0, &pair.1, [1.0; 3]), "{:?}", options.method);
        }
    }

    #[test]
    fn rotation_does_not_matter(errors in errors(), seed in 0..1000_u64) {
        let plain = Seen::plain(&errors);
        let turned = Seen { rotation: Some(rotation(seed)), ..Seen::plain(&errors) };
        for options in all_options() {
            let pair = (fitted(&plain, &options), fitted(&turned, &options));
            prop_assert!(same(&pair.0, &pair.1, [1.0; 3]), "{:?}", options.method);
        }
    }
}
