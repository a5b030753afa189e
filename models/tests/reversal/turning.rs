//! Traces from an artefact that turns while the slide feeds, on runs whose truth is known.

use errsep_models::reversal::staged::{Options, solve};
use errsep_models::reversal::turning::{NoTraces, Sample, find_turning, traces};
use errsep_models::reversal::{Channel, Contrast};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;

const FREQUENCY: f64 = 0.0427;
const ALPHA: f64 = 30e-6;

/// A bar that runs out by 12 µm at one end and 20 µm at the other while 200 mm pass.
fn run(sigma: f64, seed: u64) -> Vec<Sample> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, sigma).unwrap();
    (0..16_000)
        .map(|k| {
            let time = 0.21 * f64::from(k) + 3.0;
            let x = 0.0595 * (time - 3.0);
            let wave = (12.0 + 0.04 * x) * (TAU * FREQUENCY * time + 0.7).cos();
            let second = 0.8 * (2.0 * TAU * FREQUENCY * time + 2.0).cos();
            Sample {
                time,
                x,
                value: 40.0 + ALPHA * 1e3 * x + wave + second + noise.sample(&mut random),
            }
        })
        .collect()
}

#[test]
fn the_wave_tells_how_the_spindle_turned() {
    for seed in 0..2 {
        let turning = find_turning(&run(0.5, seed), None).unwrap();
        // k·u: four standard uncertainties.
        let error = turning.spindle - FREQUENCY;
        assert!(error.abs() < 4.0 * turning.spindle_std, "{turning:?}");
        // A bar that runs out by 16 µm may be inclined across by as much as 0.5 √(2/16000) µm of its length show, some
        // 1.5 µm at either end: 0.2 rad in 3360 s.
        assert!(turning.spindle_std < 2e-5, "{turning:?}");
        // 12 + 0.04 × 100 µm in the middle; k·u of 0.5 √(2/16000) = 5.6 nm.
        assert!(
            (turning.amplitude - 15.998).abs() < 0.03,
            "{}",
            turning.amplitude
        );
        let phase = (TAU * FREQUENCY * turning.highest_at + 0.7).rem_euclid(TAU);
        let angle = (phase + 1.0).rem_euclid(TAU) - 1.0;
        assert!(angle.abs() < 5.0 * turning.angle_std_rad, "{angle}");
    }
}

/// At one angle of a wave that strays by most of a turn the spindle stands at many: no angle is told.
#[test]
fn a_turn_that_strays_tells_no_angle() {
    let mut samples = run(0.5, 1);
    let span = samples[samples.len() - 1].time;
    for sample in &mut samples {
        let part = sample.time / span;
        let stray = 2.6 * (2.0 * part - 1.0).powi(2) * 2.0;
        let angle = TAU * FREQUENCY * sample.time + 0.7;
        sample.value += 16.0 * ((angle + stray).cos() - angle.cos());
    }
    let turning = find_turning(&samples, None).unwrap();
    assert!(!turning.tells_angle(), "{turning:?}");
    assert!(find_turning(&run(0.5, 1), None).unwrap().tells_angle());
}

#[test]
fn two_opposite_angles_give_the_tilt_of_the_slide() {
    for (seed, degrees) in [(1, 0.0_f64), (2, 37.0), (3, 90.0)] {
        let samples = run(0.5, seed);
        let turning = find_turning(&samples, Some(0.0425)).unwrap();
        let data = traces(&samples, &turning, degrees.to_radians(), 20f64.to_radians()).unwrap();
        assert_eq!(data.channels(), [Channel::C1A, Channel::C2B]);
        let solution = solve(&data, &Options::default()).unwrap();
        let alpha = solution.tilt(Contrast::Alpha).unwrap();
        // k·u: four standard uncertainties, which must themselves be that of 143 turns of some 14
        // samples with 0.5 µm over 200 mm.
        assert!((alpha.value - ALPHA).abs() < 4.0 * alpha.std, "{alpha:?}");
        assert!((0.1e-6..0.6e-6).contains(&alpha.std), "{alpha:?}");
        // At its highest the run-out grows by 0.04 µm/mm: 40 µrad; a quarter turn on it does not.
        let mount = solution.tilts[1].angle;
        let expected = 40e-6 * degrees.to_radians().cos();
        assert!(
            (mount.value - expected).abs() < 4.0 * mount.std + 0.01 * 40e-6,
            "{mount:?}"
        );
    }
}

/// A bar that is inclined across the direction in which it runs out: its wave is a little faster or slower than the spindle,
/// so that traces half a turn of the wave apart see sides that turn along it. On an oval bar that tilts both alike.
#[test]
fn an_oval_bar_is_tilted_by_the_angle_that_is_not_known() {
    let (mut beyond, mut chi) = (0, 0.0);
    for seed in 0..8 {
        let across = 1.5 - 0.4 * seed as f64;
        let phase = 0.8 * seed as f64;
        let mut samples = run(0.5, 20 + seed);
        for s in &mut samples {
            let angle = TAU * FREQUENCY * s.time + 0.7;
            let turned = across * (s.x - 100.0) / 100.0;
            s.value -= turned * angle.sin();
            s.value += 8.0 * (2.0 * angle + phase).cos();
        }
        let turning = find_turning(&samples, None).unwrap();
        // k·u of 0.5 √(2/16000) µm, and the other oval of the run, 0.8 µm.
        assert!((turning.oval.norm() - 8.0).abs() < 0.9, "{turning:?}");
        let data = traces(&samples, &turning, 0.0, 20f64.to_radians()).unwrap();
        let solution = solve(&data, &Options::default()).unwrap();
        let alpha = solution.tilt(Contrast::Alpha).unwrap();
        let error = alpha.value - ALPHA;
        let std = alpha.std.hypot(turning.slope_std(0.0, 199.0));
        // k·u: eight runs.
        assert!(error.abs() < 3.5 * std, "{seed}: {error} {alpha:?} {std}");
        beyond += usize::from(error.abs() > 4.0 * alpha.std);
        chi += (error / std).powi(2) / 8.0;
    }
    assert!(beyond >= 4, "{beyond} of 8");
    // A bar may be inclined across by far more than these: the uncertainty is that of not knowing.
    assert!(chi > 0.01 && chi < 3.0, "{chi}");
}

#[test]
fn refuses_what_does_not_turn() {
    let still = (0..500)
        .map(|k| Sample {
            time: f64::from(k),
            x: f64::from(k),
            value: 0.0,
        })
        .collect::<Vec<_>>();
    assert_eq!(find_turning(&still, None), Err(NoTraces::NoWave));
    assert_eq!(
        find_turning(&still[..9], None),
        Err(NoTraces::TooFew { samples: 9 })
    );
    // Far more turns than samples, and less than one turn.
    for per_second in [1e8 / 60.0, 1e300, 1e-9] {
        assert!(
            matches!(
                find_turning(&run(0.1, 1), Some(per_second)),
                Err(NoTraces::Speed { .. })
            ),
            "{per_second}"
        );
    }
    let mut back = still.clone();
    back[7].time = 1.0;
    assert_eq!(find_turning(&back, None), Err(NoTraces::Time { index: 7 }));
}
