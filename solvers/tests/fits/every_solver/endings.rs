//! Endings that are no minimum: at a wall, far out, on a plain, and beyond the range of numbers.

use errsep_solvers::{Ending, NoValue, Problem, fit, fit_structured};
use errsep_standard_problems::banded::Divided;
use nalgebra::{DMatrix, DVector};

use super::{dense_options, structured_options};

/// What a problem does where it has no value.
#[derive(Debug, Clone, Copy)]
enum Beyond {
    Refuses,
    NotANumber,
    Infinite,
}

/// Readings of 2 exp(t) at twelve times, fitted by b exp(a t), which has no value for a > 1/2.
struct Walled(Beyond);

const WALL: f64 = 0.5;

fn time(i: usize) -> f64 {
    0.2 * i as f64
}

impl Problem for Walled {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        12
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let instead = match self.0 {
            _ if p[0] <= WALL => None,
            Beyond::Refuses => return Err(NoValue::new("the rate is beyond 1/2")),
            Beyond::NotANumber => Some(f64::NAN),
            Beyond::Infinite => Some(f64::INFINITY),
        };
        Ok(DVector::from_fn(12, |i, _| {
            instead.unwrap_or_else(|| p[1] * (p[0] * time(i)).exp() - 2.0 * time(i).exp())
        }))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_fn(12, 2, |i, j| {
            let growth = (p[0] * time(i)).exp();
            [p[1] * time(i) * growth, growth][j]
        }))
    }
}

/// One residual in one parameter, with its derivative.
struct Single(fn(f64) -> (f64, f64));

impl Problem for Single {
    fn parameter_count(&self) -> usize {
        1
    }

    fn residual_count(&self) -> usize {
        1
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(DVector::from_element(1, self.0(p[0]).0))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_element(1, 1, self.0(p[0]).1))
    }
}

/// Readings of 3 exp(−0.7 t) + 1/2 with a fixed pattern of errors, in units of which one is `unit`.
struct Decay {
    unit: f64,
}

impl Problem for Decay {
    fn parameter_count(&self) -> usize {
        3
    }

    fn residual_count(&self) -> usize {
        20
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(DVector::from_fn(20, |i, _| {
            let reading = 3.0 * (-0.7 * time(i)).exp() + 0.5 + 0.01 * (1.3 * (i * i) as f64).sin();
            self.unit * (p[0] * (-p[1] * time(i)).exp() + p[2] - reading)
        }))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_fn(20, 3, |i, j| {
            let decay = (-p[1] * time(i)).exp();
            self.unit * [decay, -p[0] * time(i) * decay, 1.0][j]
        }))
    }
}

/// Five constant residuals in two parameters, with a Jacobian of this entry throughout.
struct Constant {
    slope: f64,
}

impl Problem for Constant {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        5
    }

    fn residuals(&self, _: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(DVector::from_fn(5, |i, _| 1.0 + i as f64))
    }

    fn jacobian(&self, _: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_fn(5, 2, |i, j| {
            self.slope * (1.0 + (i * j) as f64)
        }))
    }
}

/// The parameters and ending of every dense solver, then of those on a band: with all unknowns in it
/// and with the last in the border.
fn endings<P: Problem + Sync>(problem: &P, start: &[f64]) -> Vec<(String, DVector<f64>, Ending)> {
    let mut all = Vec::new();
    for (name, options) in dense_options() {
        let fit = fit(problem, DVector::from_column_slice(start), &options).expect("a good start");
        all.push((name, fit.parameters, fit.ending));
    }
    for border in 0..=1.min(start.len() - 1) {
        let form = Divided::new(problem, border);
        for (method, options) in structured_options() {
            let fit = fit_structured(&form, form.divide(start), &options).expect("a good start");
            let name = format!("structured {method}, {border} in the border");
            all.push((name, fit.parameters.joined(), fit.ending));
        }
    }
    all
}

#[test]
fn an_ending_at_a_wall_is_no_convergence_and_says_so() {
    for beyond in [Beyond::Refuses, Beyond::NotANumber, Beyond::Infinite] {
        for start in [[0.0, 1.0], [0.3, 0.2], [-1.0, 4.0]] {
            for (name, at, ending) in endings(&Walled(beyond), &start) {
                let case = format!("{name}, {beyond:?}, from {start:?}: {ending} at {at:?}");
                assert!(matches!(ending, Ending::AtWall { .. }), "{case}");
                assert!(!ending.is_minimum(), "{case}");
                assert!(at[0] <= WALL, "{case}");
            }
        }
    }
    let fit = fit(
        &Walled(Beyond::Refuses),
        DVector::from_vec(vec![0.0, 1.0]),
        &errsep_solvers::Options::default(),
    )
    .expect("a good start");
    let words = fit.ending.to_string();
    assert!(words.contains("the rate is beyond 1/2"), "{words}");
}

#[test]
fn a_minimum_short_of_a_wall_is_one() {
    // The minimum of (p − 1/4)² + 1 is half way to the wall; long first steps lead beyond it.
    struct Short;
    impl Problem for Short {
        fn parameter_count(&self) -> usize {
            1
        }
        fn residual_count(&self) -> usize {
            2
        }
        fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
            if p[0] > WALL {
                return Err(NoValue::new("beyond the wall"));
            }
            Ok(DVector::from_vec(vec![(p[0] - 0.25).sinh(), 1.0]))
        }
        fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
            Ok(DMatrix::from_vec(2, 1, vec![(p[0] - 0.25).cosh(), 0.0]))
        }
    }
    for (name, at, ending) in endings(&Short, &[-4.0]) {
        assert!(ending.is_converged(), "{name}: {ending}");
        // truncation: the cost is flat to √ε around its minimum where nothing polishes
        assert!((at[0] - 0.25).abs() <= 1e-7, "{name}: {}", at[0]);
    }
}

#[test]
fn a_parameter_that_runs_away_is_not_at_a_minimum() {
    let falling: [(&str, Single); 2] = [
        ("1/p", Single(|p| (1.0 / p, -1.0 / (p * p)))),
        ("exp(-p)", Single(|p| ((-p).exp(), -(-p).exp()))),
    ];
    for (what, problem) in &falling {
        for (name, at, ending) in endings(problem, &[1.0]) {
            let case = format!("{what}, {name}: {ending} at {}", at[0]);
            assert!(!ending.is_minimum(), "{case}");
            assert!(matches!(ending, Ending::RunsAway { .. }), "{case}");
        }
    }
}

#[test]
fn the_unit_of_the_residuals_changes_nothing() {
    let start = [2.5, 0.5, 0.3];
    let plain = endings(&Decay { unit: 1.0 }, &start);
    for (name, _, ending) in &plain {
        assert!(ending.is_converged(), "{name}: {ending}");
    }
    for unit in [1e-200, 1e-155, 1e-30, 1e30, 1e155, 1e200] {
        let scaled = endings(&Decay { unit }, &start);
        for ((name, at, ending), (_, expected, _)) in scaled.iter().zip(&plain) {
            let case = format!("{name}, unit {unit:e}: {ending} at {at:?}");
            if name.starts_with("structured") && !(1e-100..=1e100).contains(&unit) {
                assert!(matches!(ending, Ending::OutOfRange), "{case}");
                continue;
            }
            assert!(ending.is_converged(), "{case}");
            // epsilons through a condition number of some tens; what is taken on its promise stops
            // where that is 1e-20 of the cost
            let limit = if name.contains("promised") {
                1e-9
            } else {
                1e-11
            };
            assert!((at - expected).amax() <= limit, "{case} {expected:?}");
        }
    }
}

#[test]
fn the_uncertainty_does_not_depend_on_the_unit_of_the_residuals() {
    let spread = |unit: f64| {
        let start = DVector::from_vec(vec![1.0, 0.1, 0.0]);
        let fit = fit(&Decay { unit }, start, &errsep_solvers::Options::default());
        let covariance = fit.expect("a good start").covariance();
        covariance
            .scaled_by_residuals()
            .expect("17 degrees of freedom")
            .standard_uncertainties()
    };
    let expected = spread(1.0);
    for unit in [1e-200, 1e200] {
        // epsilons
        assert!(
            (spread(unit).component_div(&expected))
                .add_scalar(-1.0)
                .amax()
                <= 1e-11
        );
    }
}

#[test]
fn residuals_that_nothing_changes_determine_nothing() {
    for (name, at, ending) in endings(&Constant { slope: 0.0 }, &[1.0, 2.0]) {
        let Ending::NotIdentifiable { combinations, .. } = &ending else {
            panic!("{name}: {ending}");
        };
        assert_eq!(combinations.len(), 2, "{name}: {ending}");
        assert_eq!(at.as_slice(), [1.0, 2.0], "{name}");
    }
    // A Jacobian that promises what the residuals do not keep.
    for (name, _, ending) in endings(&Constant { slope: 1.0 }, &[1.0, 2.0]) {
        assert_eq!(ending, Ending::NoDescent, "{name}");
    }
}
