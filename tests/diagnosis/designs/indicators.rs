//! What indicators do: drift, jump, curve, play, swing with the air, and read at positions of their own.

use errsep_models::model::FittedModel;

use super::{Moment, PUT, model, named, size};

#[test]
fn drift_of_one_of_four_indicators() {
    let drift = |m: &Moment| match m.indicator() {
        90.0 => 1.5 * (1.0 - (-m.part / 0.3).exp()) / (1.0 - (-1.0f64 / 0.3).exp()),
        270.0 => -0.4 * m.part,
        _ => 0.0,
    };
    let diagnosis = named("thermal-drift", &PUT.with(drift));
    let (top, u) = size(&diagnosis, "thermal-drift", "top-drift");
    // k·u: one seed, five standard uncertainties; the drift over the test by its last reading.
    assert!((top - 1.5).abs() < 5.0 * u && u < 0.2, "{top} {u}");
}

#[test]
fn a_jump_of_one_indicator_in_all_it_reads_from_then_on() {
    let jump = |m: &Moment| f64::from(u8::from(m.indicator() == 180.0 && m.part > 0.43)) * 0.4;
    let diagnosis = named("zero-jump", &PUT.with(jump));
    let own = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == "zero-jump")
        .unwrap();
    assert_eq!(own.variant.as_deref(), Some("far indicator"));
    let (height, u) = size(&diagnosis, "zero-jump", "jump");
    // k·u: five standard uncertainties.
    assert!((height - 0.4).abs() < 5.0 * u, "{height} {u}");
}

#[test]
fn a_curved_and_a_stretched_indicator() {
    let show = |m: &Moment| {
        let seen = m.seen(m.x);
        if m.indicator() == 270.0 {
            0.6 * (seen / 150.0).powi(2)
        } else {
            0.0
        }
    };
    named("indicator-nonlinearity", &PUT.with(show));
    let stretched = |m: &Moment| f64::from(u8::from(m.indicator() == 90.0)) * 0.008 * m.seen(m.x);
    let diagnosis = named("gain-mismatch", &PUT.with(stretched));
    let own = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == "gain-mismatch")
        .unwrap();
    assert_eq!(own.variant.as_deref(), Some("top indicator"));
}

#[test]
fn play_of_one_indicator() {
    // The pointer follows the stylus once it has moved by half the width.
    let played = |trace: &[Moment]| {
        let mut pointer = trace[0].seen(trace[0].x) - 0.1;
        let follow = |m: &Moment| {
            let stylus = m.seen(m.x);
            pointer = pointer.max(stylus - 0.15).min(stylus + 0.15);
            if m.indicator() == 0.0 {
                pointer
            } else {
                stylus
            }
        };
        trace.iter().map(follow).collect()
    };
    named("hysteresis", &PUT.readings(played));
}

#[test]
fn air_that_swings_and_a_scale_that_repeats() {
    let swing = |m: &Moment| {
        let wave = (std::f64::consts::TAU * 2.6 * m.part + 0.7).sin();
        [0.25, 0.1, -0.2, 0.05][(m.indicator() / 90.0) as usize] * wave
    };
    named("ambient-cycle", &PUT.with(swing));
    let scale = |m: &Moment| match m.indicator() {
        180.0 => 0.2 * (std::f64::consts::TAU * m.seen(m.x) / 11.0).sin(),
        _ => 0.0,
    };
    named("cyclic-error", &PUT.with(scale));
}

#[test]
fn traces_on_positions_of_their_own() {
    let jump = |m: &Moment| f64::from(u8::from(m.indicator() == 180.0 && m.part > 0.43)) * 0.4;
    let mut readings = PUT.readings(|t| t.iter().map(|m| m.seen(m.x) + jump(m)).collect());
    // Each reading elsewhere by up to 0.8 mm, and what it shows with it.
    let angles: Vec<(f64, f64)> = (readings.design.channels().iter())
        .map(|c| (c.indicator.to_radians(), c.spindle.to_radians()))
        .collect();
    for (k, r) in readings.readings.iter_mut().enumerate() {
        let (phi, theta) = angles[r.channel];
        let m = Moment {
            phi,
            theta,
            way: 1.0,
            x: r.x,
            time: 0.0,
            part: 0.0,
        };
        let x = r.x + 0.8 * (k as f64 * 2.399).sin();
        r.value += m.seen(x) - m.seen(r.x);
        r.x = x;
    }
    let gathered = model(&readings);
    assert!(gathered.gathered.is_some() && gathered.channel_names().len() == 8);
    named("zero-jump", &readings);
}
