//! What slide, spindle and artefact do.

use super::{Moment, PUT, Put, SIXTEEN, TRAVEL, named, size};

#[test]
fn lost_motion_along_and_across() {
    let along = PUT.readings(|t| t.iter().map(|m| m.seen(m.x - 0.5 * 0.12 * m.way)).collect());
    named("axis-backlash", &along);
    let across = |m: &Moment| 0.5 * m.way * (0.25 + 0.1 * m.x / TRAVEL) * m.phi.sin();
    let diagnosis = named("lateral-backlash", &PUT.with(across));
    let own = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == "lateral-backlash")
        .unwrap();
    assert_eq!(own.variant.as_deref(), Some("vertical"));
}

#[test]
fn an_artefact_that_moves_when_the_spindle_turns() {
    let shifted = |m: &Moment| {
        if m.theta > 1.0 {
            m.side(m.x - 3.0) - m.side(m.x)
        } else {
            0.0
        }
    };
    let diagnosis = named("reversal-shift", &PUT.with(shifted));
    let (shift, u) = size(&diagnosis, "reversal-shift", "shift");
    // k·u: five standard uncertainties.
    assert!((shift - 3.0).abs() < 5.0 * u && u < 0.5, "{shift} {u}");
}

#[test]
fn dirt_in_one_channel() {
    let chip = |m: &Moment| match m.is_at(90.0, 180.0) {
        true => 0.5 * (-0.5 * ((m.x - 120.0) / 9.0).powi(2)).exp(),
        false => 0.0,
    };
    let diagnosis = named("local-contamination", &PUT.with(chip));
    let own = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == "local-contamination")
        .unwrap();
    // A scratch of the same depth in the channel opposite changes every side and the slide by forms that
    // are free: which of the two is named is chance, that both may be is told.
    let mut said = own
        .elsewhere
        .iter()
        .map(|a| a.variant.as_str())
        .collect::<Vec<_>>();
    said.extend(own.variant.as_deref());
    let channel = |name: &str| {
        said.iter()
            .any(|v| *v == format!("Gaussian, channel {name}"))
    };
    assert!(channel("90/180") && channel("270/180"), "{said:?}");
    assert!(!channel("0/0") && !channel("0/180"), "{said:?}");
}

#[test]
fn a_stylus_beside_the_crest() {
    // A bar of 40 mm radius that is askew by milliradians crosswise; y the distance from the crest, mm.
    let beside = |m: &Moment| {
        let psi = m.phi - m.theta;
        let y =
            m.x * (4e-4 * -m.phi.sin() - 5e-4 * m.phi.cos() - 2e-4 * psi.sin() + 3e-4 * psi.cos());
        -1e3 * y * y / 80.0
    };
    named("off-crest", &PUT.with(beside));
}

#[test]
fn a_position_of_the_spindle_that_is_not_at_its_angle() {
    // Every 90°: the tilt of the bar, turned by 20 mrad in the third position, is no other tilt.
    let put = Put {
        design: SIXTEEN,
        repeats: 2,
        positions: 40,
        ..PUT
    };
    let off = |m: &Moment| {
        let psi = m.phi - m.theta;
        let turned = psi - 0.05;
        let tilt = |psi: f64| 500e-6 * psi.cos() + 350e-6 * psi.sin();
        if m.is_at(m.indicator(), 180.0) {
            1e3 * (tilt(turned) - tilt(psi)) * m.x
        } else {
            0.0
        }
    };
    let diagnosis = named("indexing-error", &put.with(off));
    let own = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == "indexing-error")
        .unwrap();
    assert_eq!(own.variant.as_deref(), Some("spindle at 180°"));
}
