//! Four channels solved as a design are the four-channel fit.

use super::*;

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
        let told = matches!(new.noise_origin, NoiseOrigin::Repeats { .. });
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
