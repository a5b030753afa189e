//! Coverage of every kind of interval, over data with known truth.

use errsep_solvers::{
    Limit, NoValue, Options, Problem, ResidualScale, bootstrap, fit, profile_interval,
};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// y = a (1 − exp(−b t)) at `COUNT` times, ending before saturation: amplitude and rate are
/// strongly correlated and their uncertainty lopsided.
struct Saturation {
    readings: Vec<f64>,
}

const TRUTH: [f64; 2] = [10.0, 0.15];
const COUNT: usize = 16;
const LEVEL: f64 = 0.95;

fn time(i: usize) -> f64 {
    0.5 * (i + 1) as f64
}

fn value(p: &[f64], i: usize) -> f64 {
    p[0] * (1.0 - (-p[1] * time(i)).exp())
}

impl Problem for Saturation {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        COUNT
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(DVector::from_fn(COUNT, |i, _| {
            value(p.as_slice(), i) - self.readings[i]
        }))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_fn(COUNT, 2, |i, j| {
            let decay = (-p[1] * time(i)).exp();
            if j == 0 {
                1.0 - decay
            } else {
                p[0] * time(i) * decay
            }
        }))
    }
}

fn simulated(sigma: f64, seed: u64) -> Saturation {
    let mut generator = ChaCha8Rng::seed_from_u64(7);
    generator.set_stream(seed);
    let errors = Normal::new(0.0, sigma).expect("a positive deviation");
    let readings = (0..COUNT)
        .map(|i| value(&TRUTH, i) + errors.sample(&mut generator))
        .collect();
    Saturation { readings }
}

fn start() -> DVector<f64> {
    DVector::from_row_slice(&TRUTH)
}

/// k·u of a binomial share around the level, with k = 3.
fn assert_covers(covered: usize, trials: usize, what: &str) {
    let share = covered as f64 / trials as f64;
    let deviation = (LEVEL * (1.0 - LEVEL) / trials as f64).sqrt();
    println!("{what}: {:.1} % of {trials}", 100.0 * share);
    assert!((share - LEVEL).abs() <= 3.0 * deviation, "{what}: {share}");
}

#[test]
fn covariance_covers_where_the_model_is_nearly_linear() {
    const TRIALS: usize = 4000;
    let t = StudentsT::new(0.0, 1.0, (COUNT - 2) as f64).expect("14 degrees of freedom");
    let quantile = t.inverse_cdf(0.5 * (1.0 + LEVEL));
    let mut covered = [0; 2];
    for seed in 0..TRIALS {
        let fit =
            fit(&simulated(0.02, seed as u64), start(), &Options::default()).expect("computable");
        let covariance = fit.covariance().scaled_by_residuals().expect("14");
        for j in 0..2 {
            let half = quantile * covariance.standard_uncertainty(j);
            covered[j] += usize::from((fit.parameters[j] - TRUTH[j]).abs() <= half);
        }
    }
    assert_covers(covered[0], TRIALS, "covariance, amplitude");
    assert_covers(covered[1], TRIALS, "covariance, rate");
}

#[test]
fn profiles_cover_where_curvature_matters() {
    const TRIALS: usize = 1500;
    let options = Options::default();
    let mut covered = [0; 2];
    let mut lopsided = 0;
    for seed in 0..TRIALS {
        let problem = simulated(0.3, seed as u64);
        let fit = fit(&problem, start(), &options).expect("computable");
        for j in 0..2 {
            let interval =
                profile_interval(&problem, &fit, j, LEVEL, ResidualScale::Estimated, &options)
                    .expect("a regular minimum");
            covered[j] += usize::from(interval.contains(TRUTH[j]));
            let (low, high) = (interval.lower.value(-1.0), interval.upper.value(1.0));
            let ratio = (high - fit.parameters[j]) / (fit.parameters[j] - low);
            lopsided += usize::from(j == 0 && ratio > 1.5);
        }
    }
    assert_covers(covered[0], TRIALS, "profile, amplitude");
    assert_covers(covered[1], TRIALS, "profile, rate");
    // the case is one where it matters: most intervals reach half as far again upwards
    assert!(lopsided > TRIALS / 2, "{lopsided}");
}

#[test]
fn bootstrap_covers() {
    const TRIALS: usize = 600;
    const REPLICATES: usize = 399;
    let options = Options::default();
    let mut covered = [0; 2];
    let mut by_percentiles = 0;
    for seed in 0..TRIALS {
        let problem = simulated(0.02, 100_000 + seed as u64);
        let fit = fit(&problem, start(), &options).expect("computable");
        let again = bootstrap(&problem, &fit, REPLICATES, seed as u64, &options)
            .expect("14 degrees of freedom");
        assert_eq!(again.failed, 0);
        for j in 0..2 {
            let (low, high) = again
                .studentised_interval(j, LEVEL)
                .expect("399 replicates");
            covered[j] += usize::from(low <= TRUTH[j] && TRUTH[j] <= high);
        }
        let (low, high) = again.percentile_interval(0, LEVEL).expect("399 replicates");
        by_percentiles += usize::from(low <= TRUTH[0] && TRUTH[0] <= high);
    }
    println!("percentiles: {by_percentiles} of {TRIALS}");
    assert_covers(covered[0], TRIALS, "bootstrap, amplitude");
    assert_covers(covered[1], TRIALS, "bootstrap, rate");
}

#[test]
fn bootstrap_does_not_depend_on_threads() {
    let problem = simulated(0.1, 3);
    let options = Options::default();
    let fit = fit(&problem, start(), &options).expect("computable");
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| {
            bootstrap(&problem, &fit, 50, 11, &options)
                .expect("14")
                .samples
        })
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_linear_profile_is_the_covariance() {
    // exact limit: with the rate held the model is linear in the amplitude
    let problem = simulated(0.3, 5);
    let options = Options {
        bounds: Some(errsep_solvers::Bounds::none(2).with(1, 0.15, 0.15)),
        ..Options::default()
    };
    let fit = fit(&problem, start(), &options).expect("computable");
    let interval = profile_interval(&problem, &fit, 0, LEVEL, ResidualScale::Known, &options)
        .expect("a regular minimum");
    let half = 1.959_963_984_540_054 * fit.covariance().standard_uncertainty(0);
    for (limit, sign) in [(interval.lower, -1.0), (interval.upper, 1.0)] {
        let Limit::At(value) = limit else {
            panic!("{limit:?}");
        };
        // the profile's own tolerance is 1e-6 of the half width
        assert!((value - fit.parameters[0] - sign * half).abs() <= 2e-6 * half);
    }
}

#[test]
fn an_end_that_data_do_not_limit_is_open() {
    // Little more than a straight line: any small rate with a large amplitude does.
    let mut problem = simulated(0.0001, 1);
    for (i, reading) in problem.readings.iter_mut().enumerate() {
        *reading = 1.5 * time(i) - 0.02 * time(i).powi(2) + 0.3 * (i as f64 * 2.4).sin();
    }
    let options = Options::default();
    let fit = fit(&problem, start(), &options).expect("computable");
    let interval = profile_interval(&problem, &fit, 0, 0.999, ResidualScale::Estimated, &options)
        .expect("a minimum");
    assert!(matches!(interval.upper, Limit::Open(_)), "{interval:?}");
    assert!(matches!(interval.lower, Limit::At(_)), "{interval:?}");
    let bounded = Options {
        bounds: Some(errsep_solvers::Bounds::none(2).with(0, 0.0, 5000.0)),
        ..options
    };
    let interval = profile_interval(&problem, &fit, 0, 0.999, ResidualScale::Estimated, &bounded)
        .expect("a minimum");
    assert_eq!(interval.upper, Limit::Bound(5000.0));
}
