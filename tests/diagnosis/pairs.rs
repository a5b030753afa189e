//! Two effects at once, of which the search must find one beside the other.

use crate::realisations::together;
use errsep::diagnosis::{Options, Verdict, diagnose};
use errsep_models::reversal::Observations;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Injection, Scene, SceneNoise};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn verdict(effects: &[(&str, usize, f64)], seed: u64) -> Verdict {
    verdict_of(&together(effects, seed, 60).unwrap())
}

fn verdict_of(readings: &Observations) -> Verdict {
    let model = Linearised::new(readings, Assumptions::default()).unwrap();
    let options = Options {
        draws: 200,
        ..Options::default()
    };
    diagnose(&model, &options).verdict
}

/// *Simulated truth*, of one seed: both are named, and nothing else.
fn both_are_named(effects: [(&str, usize, f64); 2], seed: u64) {
    let verdict = verdict(&effects, seed);
    let mut said = verdict.effects.clone();
    said.sort();
    let mut truth = effects.map(|e| e.0);
    truth.sort_unstable();
    assert_eq!(said, truth, "{}", verdict.statement);
    assert!(
        verdict.indistinguishable.is_empty(),
        "{}",
        verdict.statement
    );
}

/// Repeats at opposite phases of a slow cycle miss it with opposite signs: that predicts held-out readings no better
/// by products of different repeats, and does by their squares.
#[test]
fn a_slow_cycle_beside_another_cause_is_named() {
    both_are_named([("ambient-cycle", 1, 1.5), ("off-crest", 1, 1.0)], 0);
}

/// *Simulated truth*: a plunger that sticks is followed from where the first pass had it, under dirt. One of the four may be
/// missed: where it lets go, again and again, is a chain of choices that rounding may turn.
#[test]
fn a_plunger_that_sticks_is_found_again_beside_dirt() {
    let effects = [
        ("sticking-plunger", 0, 1.5),
        ("local-contamination", 0, 1.0),
    ];
    let both = |seed: &u64| {
        let said = verdict(&effects, *seed);
        let all = |names: &[String]| effects.iter().all(|e| names.iter().any(|n| n == e.0));
        all(&said.effects) && said.effects.len() == 2 && said.indistinguishable.is_empty()
    };
    let named = [5, 6, 8, 9].iter().filter(|seed| both(seed)).count();
    assert!(named >= 3, "{named}");
}

/// *Simulated truth*, of one seed: a shift beside a gain, of which others may stand for either.
#[test]
fn a_shift_beside_a_gain_is_named() {
    let verdict = verdict(&[("reversal-shift", 1, 1.5), ("gain-mismatch", 1, 1.0)], 2);
    let mut said = verdict.effects.clone();
    said.sort();
    let both = ["gain-mismatch", "reversal-shift"];
    assert_eq!(said, both, "{}", verdict.statement);
}

/// *Simulated truth*, of one seed: a bar that is off its crest at mid travel too is one cause, and not a crest at mid
/// travel and a cone or what is like one.
#[test]
fn what_one_cause_does_is_not_told_as_two() {
    let effects = [
        ("off-crest", 0, 1.0),
        ("taper", 0, 2.0),
        ("local-contamination", 0, 2.5),
    ];
    let mut verdict = verdict(&effects, 0);
    verdict.effects.sort();
    let fewer = ["local-contamination", "off-crest"];
    assert_eq!(verdict.effects, fewer, "{}", verdict.statement);
}

/// *Simulated truth*: the scale of an indicator stands where play, or the growth of its mount, has moved it to, and the phase
/// of its error turns by that. Three of four seeds at least, as noise may hide either.
#[test]
fn an_error_of_the_scale_is_named_beside_what_moves_the_scale() {
    let noise = SceneNoise {
        white: 0.05,
        ..SceneNoise::default()
    };
    let scale = Injection::CyclicError {
        amplitude: 0.25,
        period: 3.1,
        phase: 0.4,
        of_reading: true,
    };
    let others = [
        ("hysteresis", Injection::Hysteresis(0.4)),
        (
            "thermal-drift",
            Injection::ThermalDrift {
                drift: 1.0,
                constant: 300.0,
                alike: false,
            },
        ),
    ];
    for (name, other) in others {
        let is_right = |seed: &u64| {
            let mut random = ChaCha8Rng::seed_from_u64(*seed);
            let mut scene = Scene::random(80, 4, 1e-4, 1.5, noise, &mut random);
            scene.effects = vec![scale, other];
            let mut verdict = verdict_of(&scene.measured(seed + 20));
            verdict.effects.sort();
            verdict.effects == ["cyclic-error", name] && verdict.indistinguishable.is_empty()
        };
        let right = (1..=4).filter(is_right).count();
        assert!(right >= 3, "{name}: {right} of 4");
    }
}
