//! The checker is checked on every standard problem first, then shown a mistake.

use errsep_solvers::{NoValue, Problem, central_differences, check_jacobian};
use errsep_standard_problems::mgh;
use errsep_standard_problems::strd;
use nalgebra::{DMatrix, DVector};

#[test]
fn derivatives_of_published_problems_are_right() {
    for problem in mgh::problems() {
        let start = problem.start_times(1.0).map(|x| x + 0.0137);
        let check = check_jacobian(&problem, &start).expect("defined near the start");
        // truncation: differences of order h⁴ on functions of moderate curvature; Brown's badly
        // scaled residuals of 1e6 lose digits to cancellation
        assert!(check.worst() < 1e-6, "{}\n{check}", problem.name);
    }
}

#[test]
fn derivatives_of_certified_problems_are_right() {
    let Some(folder) = strd::folder() else {
        println!("skipped: no folder nist_strd, see ERRSEP_DATA");
        return;
    };
    for name in strd::NAMES {
        let problem = strd::read(&folder, name).expect("a file as NIST wrote it");
        let at = DVector::from_column_slice(&problem.parameters);
        let check = check_jacobian(&problem, &at).expect("defined at the certified values");
        // truncation, as above; rounding of the residuals over the step
        assert!(check.worst() < 1e-7, "{name}\n{check}");
        let plain = central_differences(|p| problem.residuals(p), &at).expect("defined");
        let given = problem.jacobian(&at).expect("defined");
        for j in 0..at.len() {
            let size = given.column(j).amax();
            // truncation of order h² and rounding ε/h, h = ε^(1/3)
            assert!(
                (plain.column(j) - given.column(j)).amax() < 1e-5 * size,
                "{name} {j}"
            );
        }
    }
}

#[test]
fn a_wrong_derivative_is_found_and_shown() {
    struct Mistaken(mgh::Standard);
    impl Problem for Mistaken {
        fn parameter_count(&self) -> usize {
            self.0.parameter_count()
        }
        fn residual_count(&self) -> usize {
            self.0.residual_count()
        }
        fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
            self.0.residuals(p)
        }
        fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
            let mut jacobian = self.0.jacobian(p)?;
            jacobian[(4, 1)] *= 1.2;
            Ok(jacobian)
        }
        fn parameter_name(&self, index: usize) -> String {
            self.0.parameter_name(index)
        }
    }
    let problem = Mistaken(mgh::problem("08").expect("kept"));
    let check = check_jacobian(&problem, &problem.0.start_times(1.0)).expect("defined");
    assert!(check.worst() > 0.01);
    assert_eq!(check.worst_by_parameter[1].1, 4);
    assert!(check.worst_by_parameter[0].0 < 1e-9);
    let shown = check.to_string();
    assert!(
        shown.contains("x2") && shown.contains("at residual 4"),
        "{shown}"
    );
}
