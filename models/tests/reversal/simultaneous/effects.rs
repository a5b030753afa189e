//! Effects as unknowns of the fit, on readings of a machine with that fault.

use errsep_models::reversal::simultaneous::{
    Knots, Options, ReversalError, Simultaneous, Thickness, With, fit,
};
use errsep_models::reversal::{Channel, Convention, Observations};

use crate::faulty_machine::{Fault, Machine};

const NOISE: f64 = 0.05;
const CELLS: usize = 8;

fn machine() -> Machine {
    Machine::random(3, CELLS, 76, 2, NOISE)
}

fn options(effects: &[&str]) -> Options {
    Options {
        thickness: Thickness::Known(42.0),
        knots: Knots::Cells(CELLS),
        effects: effects.iter().map(|e| With::named(*e)).collect(),
        ..Options::default()
    }
}

fn fitted(observations: &Observations, effects: &[&str]) -> Simultaneous {
    fit(observations, &options(effects)).unwrap_or_else(|e| panic!("{effects:?}: {e}"))
}

/// A parameter by its name: value and standard uncertainty.
fn parameter(solution: &Simultaneous, effect: &str, name: &str) -> (f64, Option<f64>) {
    let own = solution
        .effects
        .iter()
        .find(|e| e.effect == effect)
        .unwrap();
    let found = own.parameters.iter().find(|p| p.name == name);
    let found = found.unwrap_or_else(|| panic!("no {name} in {own:?}"));
    (found.value, found.std)
}

/// k·u: everything that the machine has lies within five standard uncertainties, for one seed.
const TIMES: f64 = 5.0;

fn is_right(machine: &Machine, faults: &[Fault], effect: &str, sizes: &[(&str, f64)]) {
    let solution = fitted(&machine.measured(faults, 11), &[effect]);
    for (name, truth) in sizes {
        let (value, std) = parameter(&solution, effect, name);
        let std = std.unwrap_or_else(|| panic!("{effect}: {name} at its bound, {value}"));
        assert!(
            (value - truth).abs() < TIMES * std && std < 0.3 * truth.abs(),
            "{effect}: {name} {value} ± {std}, is {truth}"
        );
    }
    tilts_are_right(machine, &solution, effect);
    forms_are_right(machine, &solution, effect);
    // k·u: the root mean square of some 600 residuals has a relative deviation of 1/√1200; the forms'
    // own detail beside the knots, which are stretched by the tilts, is far less.
    let noise = solution.noise[0].sigma;
    assert!(
        (noise / NOISE - 1.0).abs() < 0.15,
        "{effect}: noise {noise}"
    );
}

fn tilts_are_right(machine: &Machine, solution: &Simultaneous, what: &str) {
    for (tilt, truth) in solution.tilts().iter().zip(machine.tilts) {
        let (value, std) = (tilt.angle.value, tilt.angle.std);
        assert!(
            (value - truth).abs() < TIMES * std,
            "{what}: {} {value:e} ± {std:e}, is {truth:e}",
            tilt.name
        );
    }
}

fn forms_are_right(machine: &Machine, solution: &Simultaneous, what: &str) {
    let x: Vec<f64> = (0..=10).map(|k| 30.0 * f64::from(k)).collect();
    for (profile, form) in solution.forms(&x).iter().zip(&machine.forms) {
        for ((x, value), std) in x.iter().zip(&profile.values).zip(&profile.std) {
            assert!(
                (value - form.at(*x)).abs() < TIMES * std,
                "{what}: {} at {x}: {value} ± {std}, is {}",
                profile.name,
                form.at(*x)
            );
        }
    }
}

#[test]
fn what_stands_elsewhere_is_found_with_the_tilts() {
    let machine = machine();
    is_right(
        &machine,
        &[Fault::Cone(8e-6)],
        "taper",
        &[("half-angle", 8e-6)],
    );
    is_right(
        &machine,
        &[Fault::LostMotion(0.9)],
        "axis-backlash",
        &[("backlash", 0.9)],
    );
    is_right(
        &machine,
        &[Fault::LateralPlay(0.12)],
        "lateral-backlash",
        &[("backlash", 0.12)],
    );
    is_right(
        &machine,
        &[Fault::Shift(3.0)],
        "reversal-shift",
        &[("shift", 3.0)],
    );
    is_right(
        &machine,
        &[Fault::Askew(20.0, 0.15, 0.04)],
        "off-crest",
        &[("loss", 0.3)],
    );
}

/// It shows where the two channels of a side are tilted differently, by α or β; large tilts move the
/// artefact's knots off those of the truth, and finer ones follow.
#[test]
fn a_thickness_left_out_is_found_where_the_tilt_is_large() {
    let machine = Machine {
        tilts: [30e-3, -15e-6, -150e-6],
        ..machine()
    };
    let mut options = options(&["thickness-shift"]);
    options.knots = Knots::Cells(3 * CELLS);
    let solution = fit(&machine.measured(&[Fault::Thicker(40.0)], 11), &options).unwrap();
    let (value, std) = parameter(&solution, "thickness-shift", "thickness");
    let std = std.unwrap();
    assert!(
        (value - 40.0).abs() < TIMES * std && std < 12.0,
        "{value} ± {std}"
    );
    tilts_are_right(&machine, &solution, "thickness-shift");
}

#[test]
fn what_an_indicator_does_is_found_with_the_tilts() {
    let machine = machine();
    is_right(
        &machine,
        &[Fault::Gain(0.01)],
        "gain-mismatch",
        &[("mismatch", 0.01)],
    );
    let curved = [Fault::Curvature(0.02, -0.05)];
    let observations = machine.measured(&curved, 11);
    let values = observations.readings.iter().map(|r| r.value.abs());
    let reach = values.fold(0.0, f64::max);
    let at_reach = |c: f64| c * (reach / 10.0).powi(2);
    is_right(
        &machine,
        &curved,
        "indicator-nonlinearity",
        &[
            ("near-deviation", at_reach(0.02)),
            ("far-deviation", at_reach(-0.05)),
        ],
    );
    is_right(
        &machine,
        &[Fault::Cycle(0.15, 2.3, 0.4)],
        "cyclic-error",
        &[("amplitude", 0.15), ("period", 2.3)],
    );
    is_right(
        &machine,
        &[Fault::Play(0.25)],
        "hysteresis",
        &[("width", 0.25)],
    );
}

#[test]
fn what_happens_in_time_or_at_one_place_is_found_with_the_tilts() {
    let machine = machine();
    let whole = machine.duration();
    is_right(
        &machine,
        &[Fault::Drift(0.8, -0.3, 0.25 * whole)],
        "thermal-drift",
        &[
            ("near-drift", 0.8),
            ("far-drift", -0.3),
            ("time-constant", 0.25 * whole),
        ],
    );
    is_right(
        &machine,
        &[Fault::Swing(0.12, 0.2, 5.3)],
        "ambient-cycle",
        &[
            ("near-amplitude", 0.12),
            ("far-amplitude", 0.2),
            ("period", whole / 5.3),
        ],
    );
    is_right(
        &machine,
        &[Fault::Jump(0.15, false, 0.37)],
        "zero-jump",
        &[("jump", 0.15)],
    );
    for always in [true, false] {
        is_right(
            &machine,
            &[Fault::Bump(-0.6, 113.0, 6.0, Channel::C2A, always)],
            "local-contamination",
            &[("height", -0.6), ("position", 113.0), ("width", 6.0)],
        );
    }
}

#[test]
fn a_jump_is_dated_and_its_indicator_told() {
    let machine = machine();
    let solution = fitted(
        &machine.measured(&[Fault::Jump(0.2, true, 0.61)], 5),
        &["zero-jump"],
    );
    let (time, std) = parameter(&solution, "zero-jump", "time");
    let truth = 0.61 * machine.duration();
    let std = std.unwrap();
    // k·u; a rectangle between two readings is the least.
    assert!(
        (time - truth).abs() < TIMES * std,
        "{time} ± {std} for {truth}"
    );
    assert!(
        std > 0.99 * machine.interval / 12f64.sqrt() && std < 6.0 * machine.interval,
        "{std}"
    );
    let variant = solution.effects[0].variant.as_deref();
    assert_eq!(variant, Some("near indicator, from then on"));
}

#[test]
fn two_effects_join_with_one_covariance() {
    let machine = machine();
    let faults = [Fault::Drift(0.6, 0.5, 900.0), Fault::Jump(-0.2, false, 0.7)];
    let solution = fitted(
        &machine.measured(&faults, 4),
        &["zero-jump", "thermal-drift"],
    );
    for (effect, name, truth) in [
        ("thermal-drift", "near-drift", 0.6),
        ("thermal-drift", "far-drift", 0.5),
        ("zero-jump", "jump", -0.2),
    ] {
        let (value, std) = parameter(&solution, effect, name);
        assert!(
            (value - truth).abs() < TIMES * std.unwrap(),
            "{name} {value} ± {std:?}"
        );
    }
    assert_eq!(solution.effects[0].effect, "zero-jump");
    tilts_are_right(&machine, &solution, "two effects");
}

/// *k·u*, one seed: the scale of an indicator is read where drift and play have brought it to. The phase of an error of
/// 2.3 µm turns by 0.7 in the play and by 1.6 in the drift.
#[test]
fn an_error_of_the_scale_is_found_behind_play_and_drift() {
    let machine = machine();
    let faults = [
        Fault::Play(0.25),
        Fault::Drift(0.6, 0.5, 900.0),
        Fault::Cycle(0.15, 2.3, 0.4),
    ];
    let effects = ["cyclic-error", "thermal-drift", "hysteresis"];
    let solution = fitted(&machine.measured(&faults, 4), &effects);
    for (effect, name, truth) in [
        ("hysteresis", "width", 0.25),
        ("thermal-drift", "near-drift", 0.6),
        ("thermal-drift", "far-drift", 0.5),
        ("cyclic-error", "amplitude", 0.15),
        ("cyclic-error", "period", 2.3),
    ] {
        let (value, std) = parameter(&solution, effect, name);
        let std = std.unwrap();
        assert!(
            (value - truth).abs() < TIMES * std && std < 0.3 * truth,
            "{name} {value} ± {std}"
        );
    }
    tilts_are_right(&machine, &solution, "an error of the scale");
    let noise = solution.noise[0].sigma;
    assert!((noise / NOISE - 1.0).abs() < 0.15, "noise {noise}");
}

#[test]
fn taking_the_effect_out_beforehand_gives_the_same_within_what_it_adds() {
    let machine = machine();
    let fault = [Fault::Drift(0.8, -0.3, 1500.0)];
    let with = fitted(&machine.measured(&fault, 9), &["thermal-drift"]);
    let without = fitted(&machine.measured(&[], 9), &[]);
    for (a, b) in with.tilts().iter().zip(without.tilts()) {
        let added = (a.angle.std.powi(2) - b.angle.std.powi(2)).max(0.0).sqrt();
        let apart = (a.angle.value - b.angle.value).abs();
        // k·u; the noise is estimated in both, to a few per cent.
        assert!(
            apart < TIMES * added + 0.1 * b.angle.std,
            "{}: {apart:e}, {added:e}",
            a.name
        );
        assert!(a.angle.std > 0.9 * b.angle.std);
    }
}

#[test]
fn changes_are_what_the_fault_did() {
    let machine = Machine {
        noise: 1e-4,
        ..machine()
    };
    let fault = [Fault::Gain(0.02)];
    let (with, without) = (machine.measured(&fault, 2), machine.measured(&[], 2));
    let solution = fitted(&with, &["gain-mismatch"]);
    let mut sums = [(0.0, 0.0); 4];
    let left: Vec<f64> = (0..with.readings.len())
        .map(|i| {
            let done = with.readings[i].value - without.readings[i].value;
            let left = done - solution.effect_changes[i];
            let sum = &mut sums[with.readings[i].channel.index()];
            *sum = (sum.0 + left, sum.1 + 1.0);
            left
        })
        .collect();
    // A gain about another zero moves the offsets: all else is the same. Truncation: knots that the tilts
    // stretch, noise of 1e-4 µm.
    for (reading, left) in with.readings.iter().zip(left) {
        let (sum, count) = sums[reading.channel.index()];
        assert!((left - sum / count).abs() < 1e-3, "{reading:?} {left}");
    }
}

#[test]
fn a_drift_too_slow_to_bend_has_no_time_constant() {
    let machine = machine();
    let solution = fitted(
        &machine.measured(&[Fault::Drift(0.5, 0.5, 1e9)], 6),
        &["thermal-drift"],
    );
    let (value, std) = parameter(&solution, "thermal-drift", "time-constant");
    // Either at its bound, which says so, or not told from it.
    match std {
        None => assert!(
            (value / (20.0 * machine.duration()) - 1.0).abs() < 1e-9,
            "{value}"
        ),
        Some(std) => assert!(std > 0.3 * value, "{value} ± {std}"),
    }
    let (drift, std) = parameter(&solution, "thermal-drift", "near-drift");
    assert!((drift - 0.5).abs() < TIMES * std.unwrap());
}

#[test]
fn what_the_fit_has_already_is_refused() {
    let observations = machine().measured(&[], 1);
    let refused = |options: &Options| match fit(&observations, options) {
        Err(ReversalError::EffectRefused { effect, .. }) => effect,
        other => panic!("{:?}", other.map(|s| s.effects)),
    };
    for effect in ["gravity-sag", "tip-radius", "common-gain"] {
        assert_eq!(refused(&options(&[effect])), effect);
    }
    let mut rigid = options(&["taper"]);
    rigid.convention = Convention::Rigid;
    assert_eq!(refused(&rigid), "taper");
    let mut free = options(&["thickness-shift"]);
    free.thickness = Thickness::Fitted(42.0);
    assert_eq!(refused(&free), "thickness-shift");
    assert!(matches!(
        fit(&observations, &options(&["rust"])),
        Err(ReversalError::UnknownEffect { .. })
    ));
    assert!(matches!(
        fit(&observations, &options(&["taper", "taper"])),
        Err(ReversalError::EffectTwice { .. })
    ));
}

#[test]
fn what_readings_leave_open_is_said() {
    let mut observations = machine().measured(&[], 1);
    // Three channels have as many slopes as tilts: a taper is not told from them.
    observations.readings.retain(|r| r.channel != Channel::C2B);
    let found = fit(&observations, &options(&["taper"]));
    assert!(
        matches!(
            found,
            Err(ReversalError::EffectsNotConverged { .. }
                | ReversalError::EffectNotDetermined { .. })
        ),
        "{:?}",
        found.map(|s| s.effects)
    );
    // In one direction nothing tells a backlash from a shift of all positions.
    let mut observations = machine().measured(&[], 1);
    observations
        .readings
        .retain(|r| r.direction == errsep_models::reversal::Direction::Forward);
    let found = fit(&observations, &options(&["lateral-backlash"]));
    assert!(
        matches!(
            found,
            Err(ReversalError::EffectsNotConverged { .. }
                | ReversalError::EffectNotDetermined { .. })
        ),
        "{:?}",
        found.map(|s| s.effects)
    );
}

#[test]
fn the_knots_are_chosen_beside_the_effect() {
    let machine = machine();
    let mut options = options(&["taper"]);
    options.knots = Knots::Chosen;
    let tapered = fit(&machine.measured(&[Fault::Cone(60e-6)], 8), &options).unwrap();
    options.effects.clear();
    let plain = fit(&machine.measured(&[], 8), &options).unwrap();
    assert_eq!(tapered.knots.cells(), plain.knots.cells());
    let untold = fit(&machine.measured(&[Fault::Cone(60e-6)], 8), &options).unwrap();
    assert!(untold.knots.cells() < plain.knots.cells());
}

#[test]
fn the_closure_is_the_tapers() {
    let solution = fitted(&machine().measured(&[Fault::Cone(20e-6)], 8), &["taper"]);
    let closure = solution.closure.unwrap();
    assert_eq!(closure.slope, None);
    // A stylus beside the crest at mid travel too has a line of its own, but for rounding the same.
    let askew = [Fault::Askew(20.0, 0.15, 0.04)];
    let beside = fitted(&machine().measured(&askew, 8), &["off-crest"]);
    assert_eq!(beside.closure.unwrap().slope, None);
    // k·u: what is left of the profile is noise of 4 × 4 readings a position, less the unknowns.
    assert!(closure.rms < 1.3 * NOISE / 4.0, "{}", closure.rms);
}

/// Readings with each repeat at a height of its own, within 3 µm.
fn zeroed_anew(mut observations: Observations, seed: u64) -> Observations {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut heights = std::collections::HashMap::new();
    for reading in &mut observations.readings {
        let height = heights
            .entry((reading.channel, reading.repeat))
            .or_insert_with(|| random.random_range(-3.0..3.0));
        reading.value += *height;
    }
    observations
}

/// Zeros set anew before every repeat change neither an effect's size nor tilts nor what effects change: whichever they are.
#[test]
fn heights_of_repeats_are_unknowns_beside_effects() {
    let machine = Machine::random(3, CELLS, 76, 4, NOISE);
    let dirt = Fault::Bump(0.8, 113.0, 6.0, Channel::C1B, false);
    let readings = machine.measured(&[dirt], 11);
    let of = |seed| {
        fitted(
            &zeroed_anew(readings.clone(), seed),
            &["local-contamination"],
        )
    };
    let (first, second) = (of(1), of(2));
    assert!(first.levelled_um.is_some_and(|h| h > 1.0));
    assert_eq!(first.effects.len(), 1);
    let (height, std) = parameter(&first, "local-contamination", "height");
    let std = std.unwrap();
    assert!(
        (height - 0.8).abs() < TIMES * std && std < 0.1,
        "{height} ± {std}"
    );
    tilts_are_right(&machine, &first, "zeroed anew");
    // Rounding and the end of the descent, in standard uncertainties.
    for (a, b) in first.tilts().iter().zip(second.tilts()) {
        assert!(
            (a.angle.value - b.angle.value).abs() < 1e-4 * a.angle.std,
            "{}",
            a.name
        );
    }
    for (a, b) in first.effect_changes.iter().zip(&second.effect_changes) {
        assert!((a - b).abs() < 1e-4 * NOISE && a.abs() < 1.0, "{a} {b}");
    }
}
