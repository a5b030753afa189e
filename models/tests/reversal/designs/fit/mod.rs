//! The simultaneous fit of designs: derivatives, known truth, and the four-channel fit beside it.

use errsep_models::noise::Law;
use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{
    Design, DesignChannel, DesignFitError, DesignObservations, DesignOptions, DesignReading, Zero,
    central_differences, fit, staged,
};
use errsep_models::reversal::simultaneous::{self, Knots, Noise, NoiseOrigin, Thickness};
use errsep_models::reversal::{Channel, Convention, Observations, Reading, simulate as four};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";
const THIRDS: &str = "0/0,120/0,240/0,0/120,120/120,240/120,0/240,120/240,240/240";
const NEAR_TOP: &str = "0/0,0/90,0/180,0/270,90/0,90/90,90/180,90/270";

fn plan(design: &str) -> DesignPlan {
    DesignPlan {
        slopes_rad: [2e-4, -1.5e-4, 3e-4, 1e-4, 2.5e-4, 0.0, 0.0],
        thickness_mm: 40.0,
        noise_um: 0.05,
        forms_um: [2.0, 1.0],
        seed: 11,
        ..DesignPlan::of(Design::parse(design).unwrap())
    }
}

fn options(cells: usize) -> DesignOptions {
    DesignOptions {
        thickness_mm: 40.0,
        knots: Knots::Cells(cells),
        ..DesignOptions::default()
    }
}

/// The four channels' readings as a design of two angles.
fn as_design(observations: &Observations) -> DesignObservations {
    let channels = Channel::ALL.map(DesignChannel::from).to_vec();
    let reading = |r: &Reading| DesignReading {
        channel: r.channel.index(),
        repeat: r.repeat,
        direction: r.direction,
        time: r.time,
        x: r.x,
        value: r.value,
    };
    DesignObservations {
        design: Design::new(channels).unwrap(),
        readings: observations.readings.iter().map(reading).collect(),
    }
}

/// Four channels solved as a design are the four channels solved as such, with large tilts and a thick
/// artefact, whether the number of knots is given or chosen.
#[test]
fn four_channels_are_the_four_channel_fit() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut form = |rms| four::TrueForm::random_waves(&mut rng, rms, 300.0, 6);
    let made = four::Plan {
        m: form(2.0),
        s_a: form(1.0),
        s_b: form(1.5),
        alpha_rad: 3e-3,
        gamma_rad: -2e-3,
        tau_rad: 1e-3,
        thickness_mm: 42.0,
        seed: 5,
        ..four::Plan::even(0.0, 300.0, 151, 0.03)
    };
    let (observations, _) = four::simulate(&made, &[]).unwrap();
    for (knots, noise) in [
        (Knots::Cells(12), Noise::Equal),
        (Knots::Chosen, Noise::Equal),
        (Knots::Cells(9), Noise::Declared(0.03)),
    ] {
        let old = simultaneous::fit(
            &observations,
            &simultaneous::Options {
                convention: Convention::Rigid,
                thickness: Thickness::Known(42.0),
                noise,
                knots: knots.clone(),
                ..simultaneous::Options::default()
            },
        )
        .unwrap();
        let new = fit(
            &as_design(&observations),
            &DesignOptions {
                thickness_mm: 42.0,
                noise,
                knots,
                alike: true,
                ..DesignOptions::default()
            },
        )
        .unwrap();
        assert_eq!(new.knots.breaks, old.knots.breaks);
        // Exact limit: the special case is the general one, to 1e-12 of the cost.
        let squares = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>();
        let (a, b) = (squares(&new.residuals), squares(&old.residuals));
        assert!((a / b - 1.0).abs() < 1e-12, "{a} against {b}");
        for (name, place) in [("alpha_h", 0), ("gamma_1", 1), ("cone", 2)] {
            let (own, theirs) = (new.slope(name).unwrap(), old.tilts()[place].angle);
            // Exact limit: a millionth of the standard uncertainty.
            assert!(
                (own.value - theirs.value).abs() < 1e-6 * theirs.std,
                "{name}"
            );
            assert!(
                (own.std / theirs.std - 1.0).abs() < 1e-9,
                "{name} {own:?} {theirs:?}"
            );
        }
        let x: Vec<f64> = (0..=30).map(|k| 10.0 * f64::from(k)).collect();
        for (own, theirs) in new.forms(&x).iter().zip(old.forms(&x)) {
            for k in 0..x.len() {
                let apart = (own.values[k] - theirs.values[k]).abs();
                assert!(apart < 1e-6 * theirs.std[k], "{} {apart}", own.name);
            }
        }
        let (own, theirs) = (&new.closures[0], old.closure.as_ref().unwrap());
        assert_eq!(own.name, "(1A + 1B - 2A - 2B)/4");
        assert!((own.rms - theirs.rms).abs() < 1e-9 * theirs.rms);
        let (own, theirs) = (new.position_slopes[0].value, theirs.slope.unwrap());
        assert!((own.value - theirs.value).abs() < 1e-6 * theirs.std);
    }
}

/// What repeats tell of the noise, and a channel that is noisier than the others, are the same for four
/// channels solved as a design: weights, laws and standard uncertainties.
#[test]
fn four_channels_have_the_noise_of_the_four_channel_fit() {
    let law = Law {
        white: 9e-4,
        correlated: 16e-4,
        length: 12.0,
        shift: 4e-4,
        drift: 0.0,
    };
    for (repeats, noisy) in [(4, 1.0), (4, 8.0), (1, 8.0)] {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut plan = four::Plan {
            alpha_rad: 3e-4,
            gamma_rad: -2e-4,
            thickness_mm: 42.0,
            repeats,
            ..four::Plan::even(0.0, 300.0, 121, 0.0)
        };
        plan.m = four::TrueForm::random_waves(&mut rng, 1.0, 300.0, 4);
        let (mut observations, _) = four::simulate(&plan, &[]).unwrap();
        let traces = observations
            .readings
            .chunk_by_mut(|a, b| (a.channel, a.repeat) == (b.channel, b.repeat));
        for trace in traces {
            let x: Vec<f64> = trace.iter().map(|r| r.x).collect();
            let mut noise = vec![0.0; x.len()];
            law.draw(&x, &mut rng, &mut noise);
            for (reading, own) in trace.iter_mut().zip(noise) {
                let own = if reading.channel == Channel::C1B {
                    noisy * own
                } else {
                    own
                };
                reading.value += own;
            }
        }
        let old = simultaneous::fit(
            &observations,
            &simultaneous::Options {
                convention: Convention::Rigid,
                thickness: Thickness::Known(42.0),
                knots: Knots::Cells(10),
                ..simultaneous::Options::default()
            },
        )
        .unwrap();
        let new = fit(
            &as_design(&observations),
            &DesignOptions {
                thickness_mm: 42.0,
                ..options(10)
            },
        )
        .unwrap();
        let told = matches!(new.noise_origin, NoiseOrigin::Repeats(_));
        assert_eq!(told, repeats > 1, "{:?}", new.noise_origin);
        for (own, theirs) in new.by_channel.iter().zip(&old.noise) {
            // Exact limit: sigmas settle at the same weights, to the rounding of two minima.
            assert!(
                (own.sigma / theirs.sigma - 1.0).abs() < 1e-6,
                "{own:?} {theirs:?}"
            );
        }
        assert_eq!(
            new.by_channel[1].sigma > 4.0 * new.by_channel[0].sigma,
            noisy > 1.0
        );
        for (name, place) in [("alpha_h", 0), ("gamma_1", 1), ("cone", 2)] {
            let slopes = new.slopes();
            let own = slopes.iter().find(|s| s.name == name).unwrap();
            let tilt = &old.tilts()[place];
            // Exact limit: a millionth of the standard uncertainty, and of its ratio.
            let apart = (own.value.value - tilt.angle.value).abs();
            assert!(apart < 1e-6 * tilt.angle.std, "{name} {own:?} {tilt:?}");
            let times = own.value.std / tilt.angle.std;
            assert!(
                (times - 1.0).abs() < 1e-6,
                "{name} {repeats} {noisy}: {times}"
            );
            let freedoms = own.degrees_of_freedom / tilt.degrees_of_freedom;
            assert!((freedoms - 1.0).abs() < 1e-6, "{name}: {freedoms}");
        }
        let x = [0.0, 111.0, 300.0];
        for (own, theirs) in new.forms(&x).iter().zip(old.forms(&x)) {
            for (a, b) in own.std.iter().zip(&theirs.std) {
                assert!((a / b - 1.0).abs() < 1e-6, "{}: {a} {b}", own.name);
            }
        }
        let (own, theirs) = (
            new.position_slopes[0].value,
            old.closure.as_ref().unwrap().slope.unwrap(),
        );
        assert!(
            (own.std / theirs.std - 1.0).abs() < 1e-6,
            "{own:?} {theirs:?}"
        );
        let x = &new
            .if_correlated(&as_design(&observations), 0.5, 15.0)
            .unwrap();
        let y = old.if_correlated(&observations, 3, (0.5, 15.0)).unwrap();
        assert!((x[0] / y[0] - 1.0).abs() < 1e-6, "{x:?} {y:?}");
    }
}

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

/// What cannot be solved is told.
#[test]
fn endings_are_told() {
    let (good, _) = simulate(&plan(EIGHT)).unwrap();
    let spoiled = |spoil: &dyn Fn(&mut DesignReading)| {
        let mut bad = good.clone();
        bad.readings.iter_mut().for_each(spoil);
        fit(&bad, &options(8)).unwrap_err()
    };
    let one = spoiled(&|r| {
        if r.channel == 3 {
            r.x = 7.0;
        }
    });
    assert!(
        matches!(&one, DesignFitError::OnePosition { channel, .. } if channel == "270/0"),
        "{one}"
    );
    let steep = spoiled(&|r| {
        if r.channel == 2 {
            r.value = 2e3 * r.x;
        }
    });
    assert!(
        matches!(&steep, DesignFitError::TooSteep { channel, .. } if channel == "90/0"),
        "{steep}"
    );
    let nan = spoiled(&|r| r.value = f64::NAN);
    assert!(matches!(nan, DesignFitError::NotUsable { .. }), "{nan}");
    let mut few = good.clone();
    few.readings.retain(|r| r.channel != 5);
    let none = fit(&few, &options(8)).unwrap_err();
    assert!(matches!(none, DesignFitError::NoReading { .. }), "{none}");
    let many = fit(&good, &options(400)).unwrap_err();
    assert!(
        matches!(many, DesignFitError::TooManyKnots { most: 58, .. }),
        "{many}"
    );
}

#[test]
fn a_prediction_and_its_residual_make_the_reading() {
    let (made, _) = simulate(&DesignPlan {
        slopes_rad: [2e-3, -1e-3, 3e-3, 1e-3, 5e-4, 0.0, 0.0],
        length_mm: 200.0,
        positions: 31,
        noise_um: 0.1,
        seed: 5,
        ..plan("0/0,90/0,120/0,0/180,90/180,120/180")
    })
    .unwrap();
    let options = DesignOptions {
        thickness_mm: 40.0,
        ..DesignOptions::default()
    };
    let found = fit(&made, &options).unwrap();
    for (reading, residual) in made.readings.iter().zip(&found.residuals) {
        let predicted = found.predict(reading.channel, reading.x).unwrap();
        // ε·κ: readings of 1e3 µm, the point of contact by two ways of finding it.
        assert!(
            (predicted + residual - reading.value).abs() < 1e-8,
            "{reading:?}: {predicted} {residual}"
        );
    }
    assert!(found.predict(6, 0.0).is_err());
}

/// A fit that is broken off says where it stood: no value of it is an answer.
#[test]
fn a_fit_that_is_broken_off_says_where_it_stood() {
    let (observations, _) = simulate(&plan(EIGHT)).unwrap();
    let mut options = options(8);
    options.minimisation.max_iterations = 1;
    let Err(DesignFitError::NotConverged { ending, reached }) = fit(&observations, &options) else {
        panic!("one step of a search that begins far away is no minimum");
    };
    assert!(!ending.is_empty());
    let names: Vec<&str> = reached.tilts.iter().map(|(name, _)| &name[..]).collect();
    assert!(
        names.starts_with(&["gamma_1", "gamma_2", "cone"]),
        "{names:?}"
    );
    assert!(reached.tilts.iter().all(|(_, rad)| rad.abs() < 1.0));
    assert!(reached.residual_rms_um.is_some_and(f64::is_finite));
    assert_eq!((reached.thickness_mm, reached.iterations), (None, 1));
}
