//! The thickness as an unknown of a design.

use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{Design, DesignFitError, DesignOptions, fit};
use errsep_models::reversal::simultaneous::Knots;

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";

fn plan(slope: f64, seed: u64) -> DesignPlan {
    DesignPlan {
        slopes_rad: [slope, -0.7 * slope, 1.3 * slope, 0.6 * slope, 0.0, 0.0, 0.0],
        thickness_mm: 40.0,
        noise_um: 0.05,
        forms_um: [2.0, 10.0],
        positions: 121,
        seed,
        ..DesignPlan::of(Design::parse(EIGHT).unwrap())
    }
}

fn options() -> DesignOptions {
    DesignOptions {
        thickness_mm: 35.0,
        fit_thickness: true,
        knots: Knots::Cells(20),
        ..DesignOptions::default()
    }
}

/// Where slopes and forms are large the thickness is found, and its errors are as large as its uncertainty.
#[test]
fn a_thickness_that_shows_is_found() {
    let mut squares = 0.0;
    for seed in 0..16 {
        let (readings, _) = simulate(&plan(8e-3, seed)).unwrap();
        let found = fit(&readings, &options()).unwrap().thickness().unwrap();
        // What shows is known to a tenth of itself; how much better depends on the slopes that the forms have.
        assert!(found.value.std < 4.0, "{found:?}");
        squares += ((found.value.value - 40.0) / found.value.std).powi(2);
    }
    let rms = f64::sqrt(squares / 16.0);
    // k·u: 16 values, whose root mean square has a standard deviation of 18 %; three of these.
    assert!(
        (rms - 1.0).abs() < 0.53,
        "errors are {rms} times their uncertainty"
    );
}

/// Where it does not show there is no number, but what it would be worth.
#[test]
fn a_thickness_that_does_not_show_is_refused() {
    let (readings, _) = simulate(&plan(1e-5, 1)).unwrap();
    match fit(&readings, &options()) {
        Err(DesignFitError::ThicknessNotDetermined { std_mm }) => assert!(std_mm > 35.0),
        other => panic!("{:?}", other.map(|f| f.thickness())),
    }
}
