//! Effects in simulated readings of eight channels: what each does, by hand.

use errsep_models::reversal::Direction;
use errsep_models::reversal::designs::simulate::{
    DESIGN_EFFECTS, DesignEffect, DesignEffectKind as Kind, DesignPlace as Place, DesignPlan,
    frame, simulate,
};
use errsep_models::reversal::designs::{Design, DesignReading};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const EIGHT: &str = "0/0,90/0,180/0,270/0,0/180,90/180,180/180,270/180";
const TRAVEL: f64 = 300.0;

fn plan() -> DesignPlan {
    DesignPlan {
        slopes_rad: [6e-5, -4e-5, 5e-4, 3.5e-4, 1.5e-5, 0.0, 0.0],
        thickness_mm: 40.0,
        forms_um: [1.5, 1.0],
        repeats: 2,
        both_directions: true,
        turned_each_repeat: true,
        seed: 4,
        ..DesignPlan::of(Design::parse(EIGHT).unwrap())
    }
}

/// What an effect changes, reading by reading.
fn changes(effect: DesignEffect) -> Vec<(DesignReading, f64)> {
    changes_of(plan(), effect)
}

/// The same where slide and sides are straight.
fn without_forms(effect: DesignEffect) -> Vec<(DesignReading, f64)> {
    let plan = DesignPlan {
        forms_um: [0.0; 2],
        ..plan()
    };
    changes_of(plan, effect)
}

fn changes_of(plan: DesignPlan, effect: DesignEffect) -> Vec<(DesignReading, f64)> {
    let (bare, _) = simulate(&plan).unwrap();
    let with = DesignPlan {
        effects: vec![effect],
        ..plan
    };
    let (with, _) = simulate(&with).unwrap();
    let pairs = bare.readings.into_iter().zip(with.readings);
    pairs.map(|(a, b)| (a, b.value - a.value)).collect()
}

fn at(kind: Kind, size: f64, place: Place) -> DesignEffect {
    DesignEffect { kind, size, place }
}

fn way(r: &DesignReading) -> f64 {
    match r.direction {
        Direction::Forward => 1.0,
        Direction::Backward => -1.0,
    }
}

/// Angles of indicator and side, rad, by the list above.
fn angles(r: &DesignReading) -> (f64, f64) {
    let phi = 90.0 * (r.channel % 4) as f64;
    let theta = 180.0 * (r.channel / 4) as f64;
    (phi.to_radians(), (phi - theta).to_radians())
}

/// Σ of the slopes that a channel sees, rad.
fn tilt(r: &DesignReading) -> f64 {
    let (phi, psi) = angles(r);
    6e-5 * phi.cos() - 4e-5 * phi.sin() + 5e-4 * psi.cos() + 3.5e-4 * psi.sin() + 1.5e-5
}

/// Every effect of the list is one, changes readings, and nothing when it is of size zero.
#[test]
fn every_name_is_an_effect() {
    let frame = frame(&plan()).unwrap();
    for name in DESIGN_EFFECTS {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let made = |size: f64, random: &mut ChaCha8Rng| {
            DesignEffect::named(name, size, &plan().design, &frame, random).unwrap()
        };
        let effect = made(0.01, &mut random);
        let largest = changes(effect)
            .iter()
            .fold(0.0_f64, |m, (_, c)| m.max(c.abs()));
        assert!(largest > 1e-9, "{name}: {largest}");
        if !matches!(effect.kind, Kind::OffCrest) {
            let nothing = changes(DesignEffect {
                size: 0.0,
                ..effect
            });
            // Rounding: readings of 200 µm.
            assert!(nothing.iter().all(|(_, c)| c.abs() < 1e-9), "{name}");
        }
    }
    assert_eq!(
        DesignEffect::named(
            "tapper",
            1.0,
            &plan().design,
            &frame,
            &mut ChaCha8Rng::seed_from_u64(1)
        ),
        None
    );
    let one = Design::parse("0/0,180/0").unwrap();
    for name in ["reversal-shift", "indexing-error"] {
        let none = DesignEffect::named(name, 1.0, &one, &frame, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(none, None, "{name}");
    }
}

/// Slide and spindle: lost motion, angle, cone, oval cone, steps across.
#[test]
fn what_moves_slide_and_artefact() {
    for (r, change) in changes(at(Kind::Taper, 2e-6, Place::Everywhere)) {
        // Truncation: products of slopes of 1e-3 with 2e-6 over 300 mm.
        assert!((change - 2e-3 * r.x).abs() < 2e-3, "{r:?} {change}");
    }
    for (r, change) in changes(at(Kind::OvalCone { sine: false }, 2e-6, Place::Everywhere)) {
        let (_, psi) = angles(&r);
        assert!(
            (change - 2e-3 * r.x * (2.0 * psi).cos()).abs() < 2e-3,
            "{r:?}"
        );
    }
    for (r, change) in changes(at(Kind::IndexingError, 1e-3, Place::Position(1))) {
        let (_, psi) = angles(&r);
        let turned = 5e-4 * psi.sin() - 3.5e-4 * psi.cos();
        let expected = if r.channel < 4 { 0.0 } else { turned * r.x };
        // Truncation: half the square of the angle, 2.5e-4 of it; slopes of the forms.
        assert!(
            (change - expected).abs() < 1e-3 * expected.abs() + 1e-3,
            "{r:?} {change}"
        );
    }
    for (r, change) in without_forms(at(Kind::AxisBacklash, 0.2, Place::Everywhere)) {
        let expected = -0.1 * way(&r) * 1e3 * tilt(&r);
        // Truncation: tan of slopes of 1e-3.
        assert!(
            (change - expected).abs() < 1e-6,
            "{r:?} {change} {expected}"
        );
    }
    for (r, change) in changes(at(Kind::LateralBacklash, 0.4, Place::Axis(1))) {
        let (phi, _) = angles(&r);
        // Rounding.
        assert!((change - 0.2 * way(&r) * phi.sin()).abs() < 1e-9, "{r:?}");
    }
    let (_, truth) = simulate(&plan()).unwrap();
    for (r, change) in changes(at(Kind::ReversalShift, 3.0, Place::Position(1))) {
        let side = &truth.sides[plan().design.side_of(r.channel)];
        let expected = match r.channel < 4 {
            true => 0.0,
            false => side.at(r.x - 3.0) - side.at(r.x),
        };
        // Truncation: a probe on a bar of 40 mm tilted by 6e-4 touches 12 µm aside.
        assert!(
            (change - expected).abs() < 2e-3,
            "{r:?} {change} {expected}"
        );
    }
    let slips = Kind::StickSlip {
        slips: 5.0,
        state: 0.25,
    };
    for (r, change) in without_forms(at(slips, 0.2, Place::Everywhere)) {
        let run = way(&r) * (r.x / TRAVEL - 0.5);
        let behind = 0.2 * (5.0 * run + 0.25).rem_euclid(1.0);
        let expected = -way(&r) * behind * 1e3 * tilt(&r);
        // Truncation: tan of slopes of 1e-3.
        assert!(
            (change - expected).abs() < 1e-6,
            "{r:?} {change} {expected}"
        );
    }
}

/// The stylus: dirt, beside the crest, sag.
#[test]
fn what_stands_under_the_stylus() {
    let dirt = Kind::LocalContamination {
        repeat: Some(2),
        x: 120.0,
        width: 6.0,
    };
    for (r, change) in changes(at(dirt, 0.5, Place::Channel(5))) {
        let bump = 0.5 * (-0.5 * ((r.x - 120.0) / 6.0).powi(2)).exp();
        let expected = if r.channel == 5 && r.repeat == 2 {
            bump
        } else {
            0.0
        };
        assert!((change - expected).abs() < 1e-9, "{r:?}");
    }
    let (_, truth) = simulate(&plan()).unwrap();
    for (r, change) in changes(at(Kind::OffCrest, 0.5, Place::Everywhere)) {
        let (phi, psi) = angles(&r);
        let askew = -6e-5 * phi.sin() - 4e-5 * phi.cos() - 5e-4 * psi.sin() + 3.5e-4 * psi.cos();
        let wandered = truth.slide[1].at(r.x) * phi.cos() - truth.slide[0].at(r.x) * phi.sin();
        let beside = 0.5 + askew * (r.x - 150.0) + 1e-3 * wandered;
        let expected = -1e3 * beside * beside / (2.0 * 21.5);
        assert!(
            (change - expected).abs() < 1e-9,
            "{r:?} {change} {expected}"
        );
    }
    for (r, change) in changes(at(Kind::GravitySag, 2.0, Place::Everywhere)) {
        let (phi, _) = angles(&r);
        if r.x == TRAVEL {
            // A beam held at one end: all of it at the free end, up and down.
            assert!((change - 2.0 * phi.sin()).abs() < 1e-9, "{r:?} {change}");
        }
    }
}

/// The indicators: gain, curve, drift, jump, waves, play.
#[test]
fn what_an_indicator_shows() {
    let own = |r: &DesignReading| r.channel % 4 == 2;
    for (r, change) in changes(at(Kind::GainMismatch, 0.01, Place::Indicator(2))) {
        assert!(own(&r) || change == 0.0, "{r:?}");
        if own(&r) && r.x == TRAVEL {
            // Truncation: forms of 1.5 µm beside the climb from the middle.
            let climb = 1e3 * tilt(&r) * 150.0;
            assert!((change - 0.01 * climb).abs() < 0.08, "{r:?} {change}");
        }
    }
    let drift = changes(at(
        Kind::ThermalDrift { constant: 30.0 },
        0.8,
        Place::Everywhere,
    ));
    let last = drift
        .iter()
        .map(|(r, _)| r.time.unwrap())
        .fold(0.0, f64::max);
    for (r, change) in &drift {
        let part = (1.0 - (-r.time.unwrap() / 30.0).exp()) / (1.0 - (-last / 30.0).exp());
        assert!((change - 0.8 * part).abs() < 1e-9, "{r:?}");
    }
    // Two repeats, two positions, two directions of 61 readings half a second apart.
    assert!(
        (last - 0.5 * f64::from(2 * 2 * 2 * 61 - 1)).abs() < 1e-9,
        "{last}"
    );
    for (r, change) in changes(at(Kind::ZeroJump { time: 100.0 }, 0.3, Place::Indicator(2))) {
        let expected = if own(&r) && r.time.unwrap() > 100.0 {
            0.3
        } else {
            0.0
        };
        assert!((change - expected).abs() < 1e-9, "{r:?}");
    }
    let wave = Kind::CyclicPosition {
        period: 20.0,
        phase: 0.4,
    };
    for (r, change) in changes(at(wave, 0.2, Place::Position(1))) {
        let expected = 0.2 * (std::f64::consts::TAU * r.x / 20.0 + 0.4).sin();
        let expected = if r.channel < 4 { 0.0 } else { expected };
        assert!((change - expected).abs() < 1e-9, "{r:?}");
    }
    // A pointer stands half the play from its stylus, behind it; it turns round within a trace only
    // where the climb is less than the forms' slopes.
    for (r, change) in changes(at(Kind::Hysteresis, 0.3, Place::Indicator(2))) {
        assert!(own(&r) || change == 0.0, "{r:?}");
        assert!(change.abs() < 0.15 + 1e-9, "{r:?} {change}");
        if r.channel == 2 {
            let behind = -0.15 * way(&r) * tilt(&r).signum();
            assert!((change - behind).abs() < 1e-9, "{r:?} {change}");
        }
    }
    let square = changes(at(
        Kind::IndicatorNonlinearity { cubic: false },
        0.4,
        Place::Indicator(2),
    ));
    let cube = changes(at(
        Kind::IndicatorNonlinearity { cubic: true },
        0.4,
        Place::Indicator(2),
    ));
    for ((r, two), (_, three)) in square.iter().zip(&cube) {
        assert!(own(r) || (*two == 0.0 && *three == 0.0), "{r:?}");
        // (c/0.4)^(1/2) and (c/0.4)^(1/3) are the same share of the greatest reading; a bent scale reads
        // no more than its deviation there.
        let share = (two / 0.4).sqrt();
        assert!(
            (three.abs() / 0.4 - share.powi(3)).abs() < 1e-9 && share <= 1.0,
            "{r:?}"
        );
    }
}
