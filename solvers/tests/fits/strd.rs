//! The certified regression problems of NIST: 27 data sets, two starts each.
//!
//! Digits are −log₁₀ of the relative error against the certified value, at most the 11 certified.

use errsep_solvers::{Fit, Options, ProjectedJacobian, fit, fit_separable};
use errsep_standard_problems::separable::{self, Separable};
use errsep_standard_problems::strd::{self, Certified, NAMES, matching_digits, worst_digits};
use nalgebra::DVector;

/// Certified digits: the parameters of every problem from either start.
const PARAMETER_DIGITS: f64 = 8.0;

/// Certified digits, over all 54 fits.
const MEAN_DIGITS: f64 = 10.0;

/// Certified digits: standard deviations, which inherit the rounding of the residuals.
const DEVIATION_DIGITS: f64 = 8.0;

/// Lanczos1 is exact to 13 digits: its residuals, of 1e-13, are mostly rounding of the data and
/// of the model in double precision, and so is everything computed from them. The parameters are not
/// concerned.
const UNCERTIFIABLE_DEVIATIONS: &str = "Lanczos1";

fn certified() -> Option<Vec<Certified>> {
    let Some(folder) = strd::folder() else {
        println!("skipped: no folder nist_strd, see ERRSEP_DATA");
        return None;
    };
    let read = |name: &&str| strd::read(&folder, name).expect("a file as NIST wrote it");
    Some(NAMES.iter().map(read).collect())
}

fn from_start(problem: &Certified, start: usize) -> Fit {
    let start = DVector::from_vec(problem.starts[start].clone());
    fit(problem, start, &Options::default()).expect("a certified problem")
}

#[test]
fn all_54_converge_to_the_certified_digits() {
    let Some(problems) = certified() else { return };
    let mut sum = 0.0;
    for problem in &problems {
        for start in 0..2 {
            let fit = from_start(problem, start);
            let name = format!("{} from start {}", problem.name, start + 1);
            assert!(fit.ending.is_converged(), "{name}: {}", fit.ending);
            let digits = worst_digits(fit.parameters.as_slice(), &problem.parameters);
            assert!(digits >= PARAMETER_DIGITS, "{name}: {digits:.1} digits");
            sum += digits;
        }
    }
    let mean = sum / 54.0;
    assert!(mean >= MEAN_DIGITS, "mean {mean:.2} digits");
}

#[test]
fn standard_deviations_are_those_certified() {
    let Some(problems) = certified() else { return };
    for problem in problems
        .iter()
        .filter(|p| p.name != UNCERTIFIABLE_DEVIATIONS)
    {
        let fit = from_start(problem, 1);
        let covariance = fit
            .covariance()
            .scaled_by_residuals()
            .expect("more readings");
        let deviations = covariance.standard_uncertainties();
        let digits = worst_digits(deviations.as_slice(), &problem.deviations);
        assert!(
            digits >= DEVIATION_DIGITS,
            "{}: {digits:.1} digits",
            problem.name
        );
        let residual = fit.residual_deviation().expect("more readings");
        let digits = matching_digits(residual, problem.residual_deviation);
        assert!(
            digits >= DEVIATION_DIGITS,
            "{}: {digits:.1} digits",
            problem.name
        );
    }
}

#[test]
fn variable_projection_finds_them_without_a_start_for_what_is_linear() {
    let Some(problems) = certified() else { return };
    for problem in problems
        .iter()
        .filter(|p| separable::NAMES.contains(&p.name.as_str()))
    {
        let form = Separable::of(problem).expect("offered");
        for jacobian in [ProjectedJacobian::Kaufman, ProjectedJacobian::Full] {
            for (k, start) in problem.starts.iter().enumerate() {
                // From MGH17's first start the projected problem has a plateau in the way, see
                // the table in every_solver.
                if problem.name == "MGH17" && k == 0 {
                    continue;
                }
                let start = form.nonlinear_of(start);
                let fit = fit_separable(&form, start, jacobian, &Options::default())
                    .expect("a certified problem");
                assert!(
                    fit.ending.is_converged(),
                    "{}: {}",
                    problem.name,
                    fit.ending
                );
                let found = form.certified_order(&fit.parameters);
                let digits = worst_digits(&found, &problem.parameters);
                assert!(
                    digits >= PARAMETER_DIGITS,
                    "{} {jacobian:?}: {digits:.1} digits",
                    problem.name
                );
            }
        }
    }
}

#[test]
fn digits_count_what_matches() {
    assert_eq!(matching_digits(1.0, 1.0), 11.0);
    assert!((matching_digits(1.001, 1.0) - 3.0).abs() < 1e-9);
    assert_eq!(matching_digits(f64::NAN, 1.0), 0.0);
    assert_eq!(matching_digits(5.0, 1.0), 0.0);
}
