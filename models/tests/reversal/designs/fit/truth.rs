//! Derivatives, known truths, what is not determined, and uncertainties.

use super::*;

/// The analytic derivatives of every unknown against central differences, in designs with none, one and
/// two forms of the slide in a channel, and with kept zeros.
#[test]
fn derivatives_are_those_of_central_differences() {
    for (design, zero) in [
        (EIGHT, Zero::Reset),
        (THIRDS, Zero::Reset),
        (THIRDS, Zero::Kept),
        (NEAR_TOP, Zero::Kept),
    ] {
        let (observations, _) = simulate(&DesignPlan {
            slopes_rad: [2e-2, -1.5e-2, 3e-2, 1e-2, 2.5e-2, 0.0, 0.0],
            forms_um: [200.0, 300.0],
            positions: 23,
            ..plan(design)
        })
        .unwrap();
        let options = DesignOptions { zero, ..options(5) };
        let worst = central_differences(&observations, &options).unwrap();
        // Truncation: central differences with a relative step of 1e-5 on readings of mm.
        assert!(worst < 1e-6, "{design} {zero:?}: {worst}");
    }
}

/// Without noise the truth is found: what is left is what splines of so many cells cannot follow.
#[test]
fn known_truth_is_found_in_every_plane() {
    for design in [EIGHT, THIRDS] {
        let made = DesignPlan {
            noise_um: 0.0,
            positions: 201,
            ..plan(design)
        };
        let (observations, truth) = simulate(&made).unwrap();
        let found = fit(&observations, &options(40)).unwrap();
        for (name, k) in [
            ("alpha_h", 0),
            ("alpha_v", 1),
            ("gamma_1", 2),
            ("gamma_2", 3),
            ("cone", 4),
        ] {
            let value = found.slope(name).unwrap().value;
            // Truncation: a spline of 7.5 mm cells misses waves of 120 mm by 2e-5 µm over 300 mm, and
            // the line of the truth is that of x, of the fit's side that of the bar's own axis.
            assert!(
                (value - truth.slopes_rad[k]).abs() < 2e-9,
                "{design} {name}: {value}"
            );
        }
        let x = made.x();
        for form in found.forms(&x) {
            assert!(form.alone);
            let true_form = match form.name.as_str() {
                "M_h" => &truth.slide[0],
                "M_v" => &truth.slide[1],
                _ => {
                    let side = form.side.unwrap();
                    let at = observations.design.sides().iter().position(|s| *s == side);
                    &truth.sides[at.unwrap()]
                }
            };
            for (x, value) in x.iter().zip(&form.values) {
                let apart = (value - true_form.at(*x)).abs();
                assert!(apart < 5e-4, "{design} {} at {x}: {apart}", form.name);
            }
        }
    }
}

/// What a design does not determine has no value by itself; what it determines together has the right
/// one.
#[test]
fn what_is_not_determined_has_no_value() {
    let made = plan(NEAR_TOP);
    let (observations, truth) = simulate(&made).unwrap();
    let found = fit(&observations, &options(8)).unwrap();
    for name in ["alpha_h", "alpha_v", "cone"] {
        assert_eq!(found.slope(name), None, "{name}");
    }
    let together = found.slopes();
    let of = |name: &str| together.iter().find(|f| f.name == name).unwrap().value;
    let [alpha_h, alpha_v, _, _, cone, ..] = truth.slopes_rad;
    for (name, value) in [
        ("alpha_h - alpha_v", alpha_h - alpha_v),
        ("alpha_v + cone", alpha_v + cone),
    ] {
        let own = of(name);
        // k·u: one seed, four standard uncertainties.
        assert!(
            (own.value - value).abs() < 4.0 * own.std,
            "{name}: {own:?} {value}"
        );
    }
    let names: Vec<String> = found.forms(&[0.0]).into_iter().map(|f| f.name).collect();
    assert_eq!(
        names,
        [
            "M_h - M_v",
            "M_v + S_0",
            "M_v + S_90",
            "M_v + S_180",
            "M_v + S_270"
        ]
    );
    assert!(found.slope("gamma_1").is_some());
}

/// Zeros that are kept give the eccentricity, and no other slopes than zeros set anew.
#[test]
fn kept_zeros_give_the_eccentricity() {
    let made = DesignPlan {
        kept_um: Some([12.0, -7.0, 3.0]),
        ..plan(NEAR_TOP)
    };
    let (observations, _) = simulate(&made).unwrap();
    let kept = fit(
        &observations,
        &DesignOptions {
            zero: Zero::Kept,
            ..options(8)
        },
    )
    .unwrap();
    for (name, value) in [("e_1", 12.0), ("e_2", -7.0), ("o", 3.0)] {
        let own = kept.constant(name).unwrap();
        // k·u: one seed, four standard uncertainties; the side's height h·tilt²/2 is 2e-3 µm at most.
        assert!(
            (own.value - value).abs() < 4.0 * own.std + 0.01,
            "{name}: {own:?}"
        );
        assert!(own.std < 0.1, "{name}: {own:?}");
    }
}

/// The staged solution is exact to first order, on one grid and on differing ones.
#[test]
fn the_staged_solution_of_a_linear_model() {
    let made = DesignPlan {
        slopes_rad: [2e-7, -1e-7, 3e-7, 1e-7, 2e-7, 0.0, 0.0],
        thickness_mm: 0.0,
        noise_um: 0.0,
        positions: 121,
        ..plan(EIGHT)
    };
    let (mut observations, truth) = simulate(&made).unwrap();
    for differing in [false, true] {
        if differing {
            // Every channel loses other positions within its trace.
            let at = made.x();
            observations.readings.retain(|r| {
                let k = at.iter().position(|x| *x == r.x).unwrap();
                k == 0 || k + 1 == at.len() || k % 8 != r.channel
            });
        }
        let found = staged::solve(&observations, Zero::Reset).unwrap();
        assert_eq!(found.x.len(), 121);
        // Truncation: tilts of 1e-7 leave 1e-13 mm to second order; interpolation over 5 mm of waves of
        // 120 mm and 1 µm leaves h²/8·k² = 9e-3 of their size.
        let tolerance = if differing { 2e-2 } else { 1e-6 };
        let names = ["gamma_1", "gamma_2", "cone", "alpha_h", "alpha_v"];
        for (name, k) in names.iter().zip([2, 3, 4, 0, 1]) {
            let own = found.slopes[names.iter().position(|n| n == name).unwrap()];
            let apart = (own - truth.slopes_rad[k]).abs() * 300e3;
            assert!(
                apart < 3.0 * tolerance,
                "{name}: {apart} µm over the travel {:?} {differing}",
                found.slopes
            );
        }
        for (k, form) in truth.sides.iter().chain(&truth.slide).enumerate() {
            for (x, value) in found.x.iter().zip(&found.forms[k]) {
                assert!(
                    (value - form.at(*x)).abs() < tolerance,
                    "form {k} at {x}, {differing}"
                );
            }
        }
    }
}

/// Uncertainties are those of the lines through the channels, and errors over many seeds are as large.
#[test]
fn uncertainties_are_the_bound_and_hold_the_truth() {
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..24 {
        let made = DesignPlan {
            seed,
            positions: 31,
            ..plan(EIGHT)
        };
        let (observations, truth) = simulate(&made).unwrap();
        let declared = DesignOptions {
            noise: Noise::Declared(0.05),
            ..options(14)
        };
        let found = fit(&observations, &declared).unwrap();
        let x = made.x();
        let spread: f64 = x.iter().map(|x| (x - 150.0).powi(2)).sum();
        let line = 0.05e-3 / spread.sqrt();
        // α_h and α_v from four channels with a weight of a quarter; the cone from eight.
        for (name, k, share) in [
            ("alpha_h", 0, 0.5),
            ("alpha_v", 1, 0.5),
            ("gamma_1", 2, 0.5),
            ("gamma_2", 3, 0.5),
            ("cone", 4, 0.125_f64.sqrt()),
        ] {
            let own = found.slope(name).unwrap();
            // Truncation: tilts of 3e-4 and slopes of the forms of 1e-4 change a derivative by 1e-7.
            assert!(
                (own.std / (share * line) - 1.0).abs() < 1e-5,
                "{name}: {own:?}"
            );
            squares += ((own.value - truth.slopes_rad[k]) / own.std).powi(2);
            count += 1.0;
        }
    }
    let rms = f64::sqrt(squares / count);
    // k·u: 120 values, whose root mean square has a standard deviation of 6.5 %; three of these.
    assert!(
        (rms - 1.0).abs() < 0.2,
        "errors are {rms} times their uncertainty"
    );
}
