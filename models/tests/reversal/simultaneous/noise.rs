//! Which noise the uncertainties are made of, and what a misfit does to the answer.

use errsep_models::noise::Law;
use errsep_models::reversal::exact_readings::Injection;
use errsep_models::reversal::injected::{Injected, Undisturbed};
use errsep_models::reversal::simulate::{Plan, simulate};
use errsep_models::reversal::simultaneous::{
    Knots, Noise, NoiseOrigin, Options, ReversalError, Simultaneous, Thickness, fit,
};
use errsep_models::reversal::{Channel, Direction, Observations, staged};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::plan::*;

pub fn plain() -> Options {
    Options {
        thickness: Thickness::Known(42.0),
        ..Options::default()
    }
}

/// Noise of a law on every trace of readings without any.
pub fn with_noise(mut data: Observations, law: &Law, seed: u64) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let repeats = data.readings.iter().map(|r| r.repeat).max().unwrap_or(1);
    let passes = (1..=repeats).flat_map(|repeat| {
        [Direction::Forward, Direction::Backward].map(|direction| (repeat, direction))
    });
    let passes: Vec<_> = passes.collect();
    for channel in Channel::ALL {
        for (repeat, direction) in &passes {
            let own: Vec<usize> = (0..data.readings.len())
                .filter(|i| {
                    let r = &data.readings[*i];
                    (r.channel, r.repeat, r.direction) == (channel, *repeat, *direction)
                })
                .collect();
            let x: Vec<f64> = own.iter().map(|i| data.readings[*i].x).collect();
            if own.is_empty() {
                continue;
            }
            let mut noise = vec![0.0; x.len()];
            law.draw(&x, &mut random, &mut noise);
            for (i, e) in own.iter().zip(noise) {
                data.readings[*i].value += e;
            }
        }
    }
    data
}

/// α of readings with a taper (µrad), which leaves it alone by symmetry, against α.
fn moved_by_taper(taper: f64, repeats: u32, seed: u64) -> (f64, Simultaneous) {
    let (mut plan, _) = spline_plan(10, 61, 0.05, seed);
    plan.tau_rad = 1e-6 * taper;
    plan.repeats = repeats;
    let solution = fit(&simulate(&plan, &[]).unwrap().0, &plain()).unwrap();
    let alpha = tilt(&solution, "alpha");
    ((alpha.value - plan.alpha_rad) / alpha.std, solution)
}

#[test]
fn a_taper_leaves_alpha_alone_and_is_told() {
    for (repeats, seeds) in [(1, 12), (3, 3)] {
        for taper in [0.5, 5.0, 20.0] {
            for seed in 0..seeds {
                let (z, solution) = moved_by_taper(taper, repeats, seed);
                // k·u: 45 cases; where the taper counts as noise α is better than its u.
                assert!(
                    z.abs() < 3.5,
                    "{taper} µrad, {repeats} repeats, seed {seed}: {z} u"
                );
                if taper > 1.0 {
                    assert_eq!(
                        solution.agreement.disagree,
                        Some(true),
                        "{taper} {repeats} {seed}"
                    );
                }
            }
        }
    }
}

#[test]
fn where_the_model_fits_nothing_is_told() {
    for seed in 0..20 {
        let (z, solution) = moved_by_taper(0.0, 1, 100 + seed);
        assert!(z.abs() < 4.0);
        assert_eq!(solution.agreement.disagree, Some(false), "{seed}");
        assert_eq!(solution.agreement.missed, 0.0);
        let first = solution.noise[0].sigma;
        assert!(solution.noise.iter().all(|n| n.sigma == first));
    }
}

/// Whatever the effect, the answer is the staged one, which has no noise to misjudge: by symmetry α is
/// left alone by some, moved alike in both by the others.
#[test]
fn effects_move_alpha_as_they_move_the_staged_one() {
    let sizes = [
        ("taper", 5e-6),
        ("reversal-shift", 0.5),
        ("thickness-shift", 5.0),
        ("gain-mismatch", 0.02),
        ("indicator-nonlinearity", 0.3),
        ("thermal-drift", 0.5),
        ("axis-backlash", 0.02),
        ("hysteresis", 0.3),
        ("zero-jump", 0.3),
        ("local-contamination", 0.5),
        ("cyclic-error", 0.15),
    ];
    for (name, size) in sizes {
        for repeats in [1, 3] {
            let (mut plan, _) = spline_plan(10, 61, 0.05, 17);
            plan.repeats = repeats;
            plan.both_directions = repeats > 1;
            let undisturbed = Undisturbed::of(&plan).unwrap();
            let mut random = ChaCha8Rng::seed_from_u64(7);
            let effect = Injection::named(name, size, &undisturbed.frame, &mut random).unwrap();
            let injected = Injected::new(effect, &undisturbed);
            let data = simulate(&plan, &[&injected]).unwrap().0;
            let solution = fit(&data, &plain()).unwrap();
            let options = staged::Options {
                thickness: Some(42.0),
                ..staged::Options::default()
            };
            let other = staged::solve(&data, &options).unwrap().tilts[0].angle.value;
            let alpha = tilt(&solution, "alpha");
            assert!(
                (alpha.value - other).abs() < 2.0 * alpha.std,
                "{name}, {repeats} repeats: {alpha:?} {other}"
            );
        }
    }
}

#[test]
fn a_noisy_channel_counts_for_less_and_a_misfit_does_not_make_one() {
    let (mut plan, _) = spline_plan(10, 151, 0.02, 5);
    plan.traces[1].noise = 0.2;
    let solution = fit(&simulate(&plan, &[]).unwrap().0, &plain()).unwrap();
    let sigma = |s: &Simultaneous, c: usize| s.noise[c].sigma;
    // k·u: 151 neighbours tell a standard deviation to 8 %.
    let ratio = sigma(&solution, 1) / sigma(&solution, 0);
    assert!((7.0..14.0).contains(&ratio), "{ratio}");
    assert_eq!(solution.agreement.disagree, Some(false));
    // A large taper outweighs it: all channels alike.
    plan.tau_rad = 100e-6;
    let solution = fit(&simulate(&plan, &[]).unwrap().0, &plain()).unwrap();
    let ratio = sigma(&solution, 1) / sigma(&solution, 0);
    assert!(ratio < 1.1, "{ratio}");
    let alpha = tilt(&solution, "alpha");
    assert!((alpha.value - plan.alpha_rad).abs() < 2.0 * alpha.std);
}

#[test]
fn repeats_tell_correlated_noise() {
    let law = Law {
        white: 0.05 * 0.05,
        correlated: 0.05 * 0.05,
        length: 15.0,
        shift: 0.0,
        drift: 0.0,
    };
    let (mut inside, mut count, mut white_inside) = (0.0, 0.0, 0.0);
    for seed in 0..40 {
        let (mut plan, basis) = spline_plan(10, 61, 0.0, seed);
        plan.repeats = 4;
        let (quiet, truth) = simulate(&plan, &[]).unwrap();
        let data = with_noise(quiet, &law, seed);
        let solution = fit(&data, &options(&basis, 42.0, Noise::Estimated)).unwrap();
        let NoiseOrigin::Repeats { law: found, .. } = solution.noise_origin else {
            panic!("{:?}", solution.noise_origin);
        };
        assert!(
            (found.variance() / law.variance() - 1.0).abs() < 0.4,
            "{found:?}"
        );
        assert_eq!(solution.agreement.disagree, Some(false), "{seed}");
        let stated = fit(
            &data,
            &options(&basis, 42.0, Noise::Declared(law.variance().sqrt())),
        );
        let stated = stated.unwrap();
        for (name, value) in truths(&truth) {
            let found = tilt(&solution, name);
            let white = tilt(&stated, name);
            inside += f64::from(u8::from((found.value - value).abs() < 1.96 * found.std));
            white_inside += f64::from(u8::from((white.value - value).abs() < 1.96 * white.std));
            count += 1.0;
        }
    }
    // k·u: a share of 0.95 of 120 is known to 0.02; four of them.
    assert!(inside / count > 0.87, "{inside} of {count}");
    // The test can fail: taken as white the same noise gives intervals that are too short.
    assert!(white_inside / count < 0.87, "{white_inside} of {count}");
}

#[test]
fn repeats_whose_positions_differ_are_compared() {
    let law = Law {
        white: 0.05 * 0.05,
        correlated: 0.05 * 0.05,
        length: 30.0,
        shift: 0.0,
        drift: 0.0,
    };
    let (mut plan, basis) = spline_plan(10, 121, 0.0, 3);
    plan.repeats = 4;
    // Steep forms: a jitter of 0.2 mm is 0.2 µm, four times the noise.
    plan.alpha_rad = 1e-3;
    let (mut data, truth) = simulate(&plan, &[]).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for reading in &mut data.readings {
        let z: f64 = StandardNormal.sample(&mut random);
        let step = 0.2 * z;
        reading.x += step;
        reading.value += step * slope_um_per_mm(&plan, reading.channel);
    }
    let data = with_noise(data, &law, 4);
    let solution = fit(&data, &options(&basis, 42.0, Noise::Estimated)).unwrap();
    let NoiseOrigin::Repeats { law: found, .. } = solution.noise_origin else {
        panic!("{:?}", solution.noise_origin);
    };
    assert!(
        (found.variance() / law.variance() - 1.0).abs() < 0.6,
        "{found:?}"
    );
    let alpha = tilt(&solution, "alpha");
    assert!((alpha.value - truth.alpha_rad).abs() < 4.0 * alpha.std);
}

/// µm/mm of a channel's line, forms aside.
fn slope_um_per_mm(plan: &Plan, channel: Channel) -> f64 {
    let i = channel.indicator_sign();
    let p = channel.spindle_sign();
    1e3 * (i * plan.alpha_rad + p * plan.beta_rad + i * p * plan.gamma_rad)
}

#[test]
fn knots_beyond_the_readings_are_refused_with_the_number_that_works() {
    let (plan, _) = spline_plan(6, 61, 0.05, 3);
    let data = simulate(&plan, &[]).unwrap().0;
    let with = |cells: usize| {
        fit(
            &data,
            &Options {
                knots: Knots::Cells(cells),
                ..plain()
            },
        )
    };
    for cells in [59, 86, 183, 20_000, 100_000_000, usize::MAX] {
        let refused = with(cells).unwrap_err();
        assert_eq!(
            refused,
            ReversalError::TooManyKnots {
                asked: cells,
                most: 58
            }
        );
    }
    let most = with(58).unwrap();
    let alpha = tilt(&most, "alpha");
    assert!((alpha.value - plan.alpha_rad).abs() < 5.0 * alpha.std);
    assert!((1e-9..1e-6).contains(&alpha.std), "{alpha:?}");
    // 61 · 4 readings less 3 · 59 coefficients, 3 tilts and 4 offsets.
    assert_eq!(most.degrees_of_freedom, 60.0);
}

#[test]
fn too_few_to_tell_the_noise_is_said_unless_it_is_stated() {
    let (plan, _) = spline_plan(1, 8, 0.05, 3);
    let mut plan = plan;
    plan.traces.truncate(1);
    plan.traces[0].positions.truncate(6);
    let data = simulate(&plan, &[]).unwrap().0;
    // Six readings, a line and two coefficients: two are left.
    let refused = fit(&data, &plain()).unwrap_err();
    assert_eq!(
        refused,
        ReversalError::TooFewToTellNoise {
            readings: 6,
            unknowns: 4,
            freedom: 2
        }
    );
    let stated = Options {
        noise: Noise::Declared(0.05),
        ..plain()
    };
    assert!(fit(&data, &stated).is_ok());
}

/// With four positions in four channels three readings are left over: intervals hold all the same.
#[test]
fn few_readings_give_wide_intervals_that_hold() {
    let (mut inside, seeds) = (0, 60);
    for seed in 0..seeds {
        let (plan, _) = spline_plan(1, 4, 0.05, 300 + seed);
        let (data, truth) = simulate(&plan, &[]).unwrap();
        let solution = fit(&data, &plain()).unwrap();
        assert_eq!(solution.degrees_of_freedom, 3.0);
        let alpha = tilt(&solution, "alpha");
        // Student's t with 3 degrees of freedom.
        inside += u32::from((alpha.value - truth.alpha_rad).abs() < 3.182 * alpha.std);
    }
    // k·u: a share of 0.95 of 60 is known to 0.028; four of them.
    assert!(f64::from(inside) / seeds as f64 > 0.84, "{inside}");
}
