//! The diagnosis of a reversal against known truth: every effect of the catalogue put in by code
//! that shares nothing with the signatures, none at all, and effects withheld.

use std::path::PathBuf;

use crate::scene::{diagnosed, scene};
use errsep::diagnosis::{Kind, Options, prove};
use errsep_models::model::FittedModel;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Injection, Scene, SceneNoise};
use errsep_models::reversal::{Channel, Direction, Observations, Reading};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Every effect of the catalogue at a size that shows well, and the tilt that it needs.
fn injected(name: &str, scene: &Scene) -> Option<Injection> {
    let travel = scene.travel();
    Some(match name {
        "taper" => Injection::Taper(2e-6),
        "reversal-shift" => Injection::ReversalShift(1.0),
        "thickness-shift" => Injection::ThicknessShift(100.0),
        "gain-mismatch" => Injection::GainMismatch(0.04),
        "indicator-nonlinearity" => Injection::IndicatorNonlinearity {
            deviation: 0.5,
            cubic: false,
        },
        "thermal-drift" => Injection::ThermalDrift {
            drift: 1.0,
            constant: 0.4 * scene.duration(),
            alike: false,
        },
        "axis-backlash" => Injection::AxisBacklash(1.0),
        "hysteresis" => Injection::Hysteresis(0.2),
        "zero-jump" => Injection::ZeroJump {
            jump: 0.2,
            channel: Channel::C2B,
            time: 0.7 * scene.duration(),
        },
        "local-contamination" => Injection::LocalContamination {
            height: 1.0,
            channel: Channel::C1B,
            repeat: Some(2),
            position: 0.4 * travel,
            width: 0.03 * travel,
        },
        "cyclic-error" => Injection::CyclicError {
            amplitude: 0.15,
            period: travel / 9.3,
            phase: 0.4,
            of_reading: false,
        },
        _ => return None,
    })
}

/// Each effect is named, alone or with those that the readings cannot tell from it; without it in
/// the catalogue nothing else is blamed alone where it has no such company.
#[test]
fn every_effect_of_the_catalogue_is_found_blind() {
    let bare = Linearised::new(&scene(1, 3e-5).exact(), Assumptions::default()).unwrap();
    let mut tried = 0;
    for effect in bare.effects() {
        let tilt = if effect.name() == "thickness-shift" {
            4e-3
        } else {
            3e-5
        };
        let mut truth = scene(11, tilt);
        let Some(injection) = injected(effect.name(), &truth) else {
            continue;
        };
        truth.effects.push(injection);
        let diagnosis = diagnosed(&truth.measured(7), &[]);
        let verdict = &diagnosis.verdict;
        assert_eq!(
            verdict.kind,
            Kind::Effect,
            "{}: {}",
            effect.name(),
            verdict.statement
        );
        let company = verdict.indistinguishable.iter().flatten();
        assert!(
            verdict
                .effects
                .iter()
                .chain(company)
                .any(|n| n == effect.name()),
            "{}: {}",
            effect.name(),
            verdict.statement
        );
        // k·u: what remains is not distinguishable from nothing at twice its 95 % interval.
        assert!(diagnosis.gap.after.rms < 0.5 * diagnosis.gap.before.rms);
        tried += 1;
    }
    assert_eq!(tried, 11);
}

#[test]
fn an_effect_that_is_withheld_is_unknown_and_closes_the_gap_when_given_back() {
    let mut truth = scene(5, 3e-5);
    truth.effects.push(Injection::ReversalShift(1.5));
    let readings = truth.measured(3);
    let withheld = diagnosed(&readings, &["reversal-shift"]);
    assert_eq!(
        withheld.verdict.kind,
        Kind::Unknown,
        "{}",
        withheld.verdict.statement
    );
    assert!(withheld.places.iter().any(|p| p.share > 0.05));
    let back = diagnosed(&readings, &[]);
    assert_eq!(back.verdict.effects, ["reversal-shift"]);
    let shift = &back.candidates[0].parameters[0];
    // k·u with k = 4.
    assert!((shift.value - 1.5).abs() < 4.0 * shift.std, "{shift:?}");
    assert!(back.gap.shrink > 0.8);
}

#[test]
fn without_an_effect_nothing_is_named_and_what_could_hide_is_listed() {
    let none = (0..6)
        .filter(|seed| {
            diagnosed(&scene(40 + seed, 3e-5).measured(*seed), &[])
                .verdict
                .kind
                == Kind::None
        })
        .count();
    // k·u: at a false-alarm probability of 1 %, two alarms in six have probability 0.0015.
    assert!(none >= 5, "{none} of 6");
    let diagnosis = diagnosed(&scene(40, 3e-5).measured(0), &[]);
    // Where there is no gap nothing explains a part of it.
    assert!(diagnosis.candidates.iter().all(|c| c.explained == 0.0));
    for name in ["gravity-sag", "tip-radius", "common-gain"] {
        let hidden = diagnosis.hidden.iter().find(|h| h.effect == name).unwrap();
        assert!(hidden.detectable.is_none(), "{name}");
    }
    let taper = diagnosis
        .hidden
        .iter()
        .find(|h| h.effect == "taper")
        .unwrap();
    assert!(taper.detectable.is_some_and(|d| d > 0.0 && d < 1e-6));
}

/// A period of the reading bends the state at which its own signature is taken: the change is 0.88
/// times as steep as the reading itself.
#[test]
fn a_steep_period_of_the_reading_is_named() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let noise = SceneNoise {
        white: 0.03,
        ..SceneNoise::default()
    };
    let mut scene = Scene::random(150, 4, 3e-5, 2.0, noise, &mut random);
    scene.effects.push(Injection::CyclicError {
        amplitude: 0.28,
        period: 2.0,
        phase: 1.0,
        of_reading: true,
    });
    let found = diagnosed(&scene.measured(5), &[]);
    assert_eq!(
        found.verdict.effects,
        ["cyclic-error"],
        "{}",
        found.verdict.statement
    );
    assert!(found.verdict.indistinguishable.is_empty());
    let amplitude = &found.candidates[0].parameters[0];
    // k·u with k = 4.
    assert!(
        (amplitude.value - 0.28).abs() < 4.0 * amplitude.std,
        "{amplitude:?}"
    );
}

/// What the model absorbs whatever its size is listed and never named, though a small part of it
/// shows: a stylus of 40 mm on forms of great slope.
#[test]
fn what_the_model_absorbs_is_never_named() {
    for name in ["tip-radius", "gravity-sag", "common-gain"] {
        let mut scene = scene(8, 3e-5);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let size = if name == "common-gain" { 0.05 } else { 40.0 };
        let frame = scene.frame();
        scene
            .effects
            .push(Injection::named(name, size, &frame, &mut random).unwrap());
        let found = diagnosed(&scene.measured(8), &[]);
        let verdict = &found.verdict;
        assert!(!verdict.effects.iter().any(|e| e == name), "{verdict:?}");
        assert!(!verdict.partial.iter().any(|e| e == name), "{verdict:?}");
        assert!(
            found
                .hidden
                .iter()
                .any(|h| h.effect == name && h.detectable.is_none())
        );
    }
}

/// Dirt in one repeat swells the noise of the first pass so that the absorbed effects show nothing at
/// all there; that they show a trace in the second makes no cause of them.
#[test]
fn what_shows_only_once_the_noise_is_clean_is_not_named() {
    for seed in 0..2 {
        let noise = SceneNoise {
            white: 0.05,
            ..SceneNoise::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut scene = Scene::random(150, 4, 3e-5, 2.0, noise, &mut random);
        let position = 0.7 * scene.travel();
        scene.effects.push(Injection::LocalContamination {
            height: 3.0,
            channel: Channel::C2B,
            repeat: Some(1),
            position,
            width: 0.03 * scene.travel(),
        });
        let verdict = diagnosed(&scene.measured(seed), &[]).verdict;
        assert_eq!(
            verdict.effects,
            ["local-contamination"],
            "{}",
            verdict.statement
        );
    }
}

/// A cone is a straight line in S_A + S_B: everywhere and nowhere. A speck of dirt has a place.
#[test]
fn a_place_is_told_only_where_there_is_one() {
    let place = |effect: Injection| {
        let mut truth = scene(9, 3e-5);
        truth.effects.push(effect);
        let places = diagnosed(&truth.measured(9), &[]).places;
        places.into_iter().find(|p| p.axis != "channel").unwrap()
    };
    let cone = place(Injection::Taper(2e-6));
    assert_eq!((cone.axis, cone.value.as_str()), ("pattern", "S_A + S_B"));
    assert_eq!((cone.from, cone.to), (None, None));
    let travel = scene(9, 3e-5).travel();
    let dirt = place(Injection::LocalContamination {
        height: 1.5,
        channel: Channel::C1B,
        repeat: None,
        position: 0.4 * travel,
        width: 0.03 * travel,
    });
    let (from, to) = (dirt.from.unwrap(), dirt.to.unwrap());
    assert!(from < 0.4 * travel && 0.4 * travel < to, "{from} {to}");
    // Ranges are tried in steps of a tenth of the travel and more.
    assert!(to - from < 0.3 * travel, "{from} {to}");
}

/// Sealed effects put into the noise of the readings themselves are found again, each at the size
/// that belongs to its signature.
#[test]
fn sealed_effects_are_found_again() {
    let mut scene = scene(12, 3e-5);
    scene.repeats = 3;
    let readings = scene.measured(12);
    let model = Linearised::new(&readings, Assumptions::default()).unwrap();
    let options = Options {
        draws: 200,
        ..Options::default()
    };
    let trials = prove(&model, model.effects(), &options, 20);
    assert_eq!(trials.counts.iter().flatten().sum::<usize>(), 20);
    // Six or more of the eleven effects that can be seen, and none at all.
    assert!(trials.truths.len() >= 7, "{:?}", trials.truths);
    assert!(trials.truths.contains(&"none".to_owned()));
    // Lower limits of 97 % right and upper of 1 % wrong in 20: each is passed with 99.9 %; the campaign `blind` counts hundreds.
    assert!(trials.right >= 16, "{trials:?}");
    assert!(trials.wrong <= 2, "{trials:?}");
}

/// The order of the readings changes nothing.
#[test]
fn the_order_of_the_readings_does_not_matter() {
    let mut truth = scene(8, 3e-5);
    truth.effects.push(Injection::Taper(1e-6));
    let readings = truth.measured(2);
    let mut turned = readings.clone();
    turned.readings.reverse();
    let (first, second) = (diagnosed(&readings, &[]), diagnosed(&turned, &[]));
    assert_eq!(first.verdict, second.verdict);
    assert_eq!(first.candidates, second.candidates);
}

/// Readings off a CAD model whose author states α = −0.4°, set-up −0.1° and a half cone of 0.05°:
/// the untapered convention has no cone, so the diagnosis must find one of that size.
#[test]
fn a_cone_in_a_cad_model_is_found() {
    let folder = std::env::var("ERRSEP_DATA").map_or_else(
        |_| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let Ok(text) = std::fs::read_to_string(folder.join("cad_reversal/cad_reversal_2.csv")) else {
        println!("skipped: the CAD readings are not here");
        return;
    };
    let mut readings = Vec::new();
    for line in text.lines().filter(|l| !l.starts_with(['#', 'z'])) {
        let fields: Vec<f64> = line.split(',').map(|f| f.trim().parse().unwrap()).collect();
        let channels = [Channel::C1A, Channel::C1B, Channel::C2B, Channel::C2A];
        for (channel, value) in channels.into_iter().zip(&fields[1..]) {
            readings.push(Reading {
                channel,
                repeat: 1,
                direction: Direction::Forward,
                time: None,
                x: fields[0],
                value: 1e3 * value,
            });
        }
    }
    let diagnosis = diagnosed(&Observations { readings }, &[]);
    assert!(
        diagnosis.verdict.effects.contains(&"taper".to_owned()),
        "{}",
        diagnosis.verdict.statement
    );
    let taper = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == "taper")
        .unwrap();
    // Exact limit: tan of angles of 0.5° differs from the angle by 2·10⁻⁷ rad, the file gives 10⁻⁸.
    assert!((taper.parameters[0].value.to_degrees() - 0.05).abs() < 1e-3);
}
