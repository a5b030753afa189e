//! The crest of a bar as a term of the fit, against a simulator that places circle on circle.

use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{
    Crest, Design, DesignObservations, DesignOptions, Zero, central_differences, fit,
};
use errsep_models::reversal::simultaneous::{Knots, Noise};

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";
const NAMES: [&str; 5] = ["alpha_h", "alpha_v", "gamma_1", "gamma_2", "cone"];

/// A bar of 40 mm under styluses of 1.5 mm.
fn plan(offset_mm: Vec<f64>) -> DesignPlan {
    DesignPlan {
        thickness_mm: 40.0,
        crest: Some(Crest {
            tip_mm: 1.5,
            offset_mm,
        }),
        forms_um: [1.0, 1.0],
        positions: 201,
        seed: 3,
        ..DesignPlan::of(Design::parse(EIGHT).unwrap())
    }
}

fn options(crest: Option<Crest>) -> DesignOptions {
    DesignOptions {
        thickness_mm: 40.0,
        crest,
        knots: Knots::Cells(40),
        ..DesignOptions::default()
    }
}

/// R 20, r 1.5, d₀ 0.5 mm and a slide 200 µrad askew across move α by −d₀·α/(R + r) = −4.65 µrad where the
/// term is left out.
#[test]
fn half_a_millimetre_beside_the_crest_moves_alpha() {
    let made = DesignPlan {
        slopes_rad: [0.0, 200e-6, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..plan(vec![0.5; 8])
    };
    let (readings, _) = simulate(&made).unwrap();
    let with = fit(&readings, &options(made.crest.clone())).unwrap();
    let without = fit(&readings, &options(None)).unwrap();
    let of = |name: &str| [&with, &without].map(|found| found.slope(name).unwrap().value);
    let [term, none] = of("alpha_h");
    // Truncation: splines of 7.5 mm cells miss waves of 120 mm by 2e-5 µm over 300 mm.
    assert!(term.abs() < 1e-9, "{term}");
    // Certified digits: three are given. The next term, d²/2ρ², adds a share of 3e-4.
    assert!((none / -4.65e-6 - 1.0).abs() < 2e-3, "{none}");
    let [term, _] = of("alpha_v");
    assert!((term - 200e-6).abs() < 1e-9, "{term}");
}

/// Indicators beside the crest by amounts of their own, slide and bar askew in both planes, zeros set anew
/// and kept with an eccentric bar: slopes are found as without any offset.
#[test]
fn what_a_stylus_loses_is_taken_out_in_every_plane() {
    for kept_um in [None, Some([30.0, -50.0, 2.0])] {
        let made = DesignPlan {
            slopes_rad: [3e-4, -4e-4, 5e-4, 2e-4, 1e-4, 0.0, 0.0],
            kept_um,
            ..plan(vec![0.8, -0.5, 0.3, 1.2, 0.8, -0.5, 0.3, 1.2])
        };
        let (readings, truth) = simulate(&made).unwrap();
        let zero = match kept_um {
            None => Zero::Reset,
            Some(_) => Zero::Kept,
        };
        let of = |crest| {
            fit(
                &readings,
                &DesignOptions {
                    zero,
                    ..options(crest)
                },
            )
        };
        let found = of(made.crest.clone()).unwrap();
        for (name, k) in NAMES.into_iter().zip(0..) {
            let value = found.slope(name).unwrap().value;
            // Truncation: as above; the bar's own bend across, 1 µm, is no term and costs
            // 1 µm·d₀/ρ·tilt at most.
            assert!(
                (value - truth.slopes_rad[k]).abs() < 2e-9,
                "{name} {kept_um:?}: {value}"
            );
        }
        let worst = |residuals: &[f64]| residuals.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
        assert!(
            worst(&found.residuals) < 2e-3,
            "{}",
            worst(&found.residuals)
        );
        let without = of(None).unwrap();
        assert!((without.slope("alpha_h").unwrap().value - 3e-4).abs() > 1e-6);
        // What the model would read where nothing was read is what it read beside.
        let x = made.x()[7];
        let at = |r: &&errsep_models::reversal::designs::DesignReading| r.x == x && r.channel == 3;
        let reading = readings.readings.iter().position(|r| at(&r)).unwrap();
        let predicted = found.predict(3, x).unwrap();
        let shown = readings.readings[reading].value - found.residuals[reading];
        // Epsilons: the same model by another way, on readings of tens of µm.
        assert!((predicted - shown).abs() < 1e-9, "{predicted} {shown}");
    }
}

/// The derivatives with the term, thickness known and unknown, zeros set anew and kept, against central
/// differences.
#[test]
fn derivatives_with_the_crest_are_those_of_central_differences() {
    for (zero, fit_thickness) in [(Zero::Reset, false), (Zero::Kept, true)] {
        let made = DesignPlan {
            slopes_rad: [2e-2, -1.5e-2, 3e-2, 1e-2, 2.5e-2, 0.0, 0.0],
            kept_um: (zero == Zero::Kept).then_some([40.0, -30.0, 5.0]),
            forms_um: [200.0, 300.0],
            positions: 23,
            noise_um: 0.05,
            ..plan(vec![0.8, -0.5, 0.3, 1.2, 0.8, -0.5, 0.3, 1.2])
        };
        let (readings, _) = simulate(&made).unwrap();
        let options = DesignOptions {
            zero,
            fit_thickness,
            knots: Knots::Cells(5),
            ..options(made.crest.clone())
        };
        let worst = central_differences(&readings, &options).unwrap();
        // Truncation: central differences with a relative step of 1e-5 on readings of mm.
        assert!(worst < 2e-6, "{zero:?}: {worst}");
    }
}

/// With noise the errors are as large as their standard uncertainties.
#[test]
fn uncertainties_with_the_crest_hold_the_truth() {
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..20 {
        let made = DesignPlan {
            slopes_rad: [3e-4, -4e-4, 5e-4, 2e-4, 1e-4, 0.0, 0.0],
            positions: 31,
            noise_um: 0.05,
            seed,
            ..plan(vec![0.8, -0.5, 0.3, 1.2, 0.8, -0.5, 0.3, 1.2])
        };
        let (readings, truth) = simulate(&made).unwrap();
        let options = DesignOptions {
            noise: Noise::Declared(0.05),
            knots: Knots::Cells(14),
            ..options(made.crest.clone())
        };
        let found = fit(&readings, &options).unwrap();
        for (name, k) in NAMES.into_iter().zip(0..) {
            let own = found.slope(name).unwrap();
            squares += ((own.value - truth.slopes_rad[k]) / own.std).powi(2);
            count += 1.0;
        }
    }
    let rms = f64::sqrt(squares / count);
    // k·u: 100 values, whose root mean square has a standard deviation of 7 %; three of these.
    assert!(
        (rms - 1.0).abs() < 0.21,
        "errors are {rms} times their uncertainty"
    );
}

/// A stylus beside the bar, a bar without diameter and offsets for other channels are refused in words.
#[test]
fn a_crest_that_cannot_be_is_refused() {
    let made = plan(vec![0.0; 8]);
    let (readings, _): (DesignObservations, _) = simulate(&made).unwrap();
    let told = |crest: Crest, thickness_mm: f64| {
        let options = DesignOptions {
            thickness_mm,
            ..options(Some(crest))
        };
        fit(&readings, &options).unwrap_err().to_string()
    };
    let crest = |tip_mm: f64, offset_mm: Vec<f64>| Crest { tip_mm, offset_mm };
    assert!(told(crest(1.5, vec![30.0; 8]), 40.0).contains("beside the stylus of"));
    assert!(told(crest(1.5, vec![0.1; 8]), 0.0).contains("thickness is 0"));
    assert!(told(crest(-1.0, vec![0.1; 8]), 40.0).contains("radius of the stylus"));
    assert!(told(crest(1.5, vec![0.1; 3]), 40.0).contains("number of offsets"));
}
