//! The diagnosis of every model but the reversal, against known truth put in by code that shares
//! nothing with the signatures.

use crate::other_models::{MAKERS, Maker, judged, seen_from, told_of};
use errsep::diagnosis::{Kind, Options, diagnose};
use errsep_models::calibration_line::simulate::{CalibrationSimulation, Disturbance, simulate};
use errsep_models::calibration_line::{CalibrationLine, CalibrationReading};
use errsep_models::circle::{self, CirclePoints, CircleSimulation, Point};
use errsep_models::model::FittedModel;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn options(without: &[&str]) -> Options {
    Options {
        draws: 200,
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        ..Options::default()
    }
}

/// Each effect, at four times the size that shows and at eight times one that is told as the least, is named alone or
/// in its group, and most of the gap is gone; nothing there gives no name.
fn found_blind(maker: &Maker) {
    for effect in maker.effects {
        let told = told_of(maker, effect, &options(&[]));
        let times = if told.at_least { 8.0 } else { 4.0 };
        let size = times * told.detectable.unwrap();
        let diagnosis = maker.diagnosed(&[(effect, size)], 7, &options(&[]));
        let said = judged(&diagnosis, Some(effect));
        assert!(
            ["named alone", "in its group"].contains(&said),
            "{} {effect}: {said}: {}",
            maker.model,
            diagnosis.verdict.statement
        );
        // k·u: what remains is far below what was there, where that stands out of its interval.
        assert!(
            diagnosis.gap.before.ci95[0] == 0.0
                || diagnosis.gap.after.rms < 0.6 * diagnosis.gap.before.rms,
            "{} {effect}: {:?}",
            maker.model,
            diagnosis.gap
        );
    }
    let alarms = (0..6)
        .filter(|seed| {
            let diagnosis = maker.diagnosed(&[], 50 + seed, &options(&[]));
            judged(&diagnosis, None) != "none, right"
        })
        .count();
    // k·u: at a false-alarm probability of 1 %, two alarms in six have probability 0.0015.
    assert!(alarms <= 1, "{}: {alarms} alarms in 6", maker.model);
}

/// An effect that is withheld is not passed over: the gap is still told.
fn not_passed_over(maker: &Maker, effect: &str) {
    let size = 4.0 * seen_from(maker, effect, &options(&[]));
    let diagnosis = maker.diagnosed(&[(effect, size)], 7, &options(&[effect]));
    assert_ne!(
        diagnosis.verdict.kind,
        Kind::None,
        "{} without {effect}: {}",
        maker.model,
        diagnosis.verdict.statement
    );
    assert!(!diagnosis.places.is_empty());
}

fn maker(model: &str) -> &'static Maker {
    static ALL: [Maker; 6] = MAKERS;
    ALL.iter().find(|m| m.model == model).unwrap()
}

#[test]
fn calibration_line() {
    found_blind(maker("calibration-line"));
    not_passed_over(maker("calibration-line"), "set-offset");
}

/// Loads that rise and fall again show a loop; its size is found. k·u: 4 of one uncertainty.
#[test]
fn a_loop_between_rising_and_falling_loads_is_hysteresis() {
    let what = CalibrationSimulation {
        line: [0.5, 2e-3],
        full_scale: 1000.0,
        loads: 20,
        sets: 3,
        both_directions: true,
        noise: 1e-3,
        disturbances: vec![Disturbance::Hysteresis(4e-3)],
    };
    let readings = simulate(&what, 3).unwrap();
    let model = CalibrationLine::new(&readings, None).unwrap();
    let diagnosis = diagnose(&model, &options(&[]));
    assert_eq!(diagnosis.verdict.effects, ["hysteresis"]);
    let found = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == "hysteresis");
    let width = &found.unwrap().parameters[0];
    assert!((width.value - 4e-3).abs() < 4.0 * width.std, "{width:?}");
}

#[test]
fn circle() {
    found_blind(maker("circle"));
    not_passed_over(maker("circle"), "lobes");
    not_passed_over(maker("circle"), "ovality");
}

#[test]
fn four_sensor() {
    found_blind(maker("four-sensor"));
    not_passed_over(maker("four-sensor"), "gain");
}

#[test]
fn fourier() {
    found_blind(maker("fourier"));
    not_passed_over(maker("fourier"), "height-difference");
}

#[test]
fn step_diagonal() {
    found_blind(maker("step-diagonal"));
    not_passed_over(maker("step-diagonal"), "mirror-misalignment");
}

#[test]
fn machine() {
    found_blind(maker("machine"));
    not_passed_over(maker("machine"), "squareness-change");
}

/// Lobes withheld are a shape that nothing else of the catalogue makes; an oval is made by axes of different scales
/// that are not square.
#[test]
fn a_shape_that_is_withheld_is_unknown() {
    let effect = "lobes";
    let circle = maker("circle");
    let size = 4.0 * seen_from(circle, effect, &options(&[]));
    let diagnosis = circle.diagnosed(&[(effect, size)], 7, &options(&[effect]));
    assert_eq!(
        diagnosis.verdict.kind,
        Kind::Unknown,
        "{}",
        diagnosis.verdict.statement
    );
}

/// Positioning errors of the slide move all sensors alike over the surface, which passes for another
/// surface but for a part too small to be seen.
#[test]
fn a_slide_position_hides() {
    let bare = maker("four-sensor").diagnosed(&[], 3, &options(&[]));
    let hidden = bare
        .hidden
        .iter()
        .find(|h| h.effect == "slide-position")
        .unwrap();
    assert!(hidden.visible < 0.02, "{}", hidden.visible);
}

/// Even drifts of sensors at 0, p, p', p'' span four directions of which a surface of third order and
/// the slide take three: whose drift it is cannot be told, and is not said.
#[test]
fn whose_drift_it_is_stays_open() {
    let four = maker("four-sensor");
    let size = 4.0 * seen_from(four, "drift", &options(&[]));
    for seed in [7, 8] {
        let diagnosis = four.diagnosed(&[("drift", size)], seed, &options(&[]));
        let drift = diagnosis.candidates.iter().find(|c| c.effect == "drift");
        let drift = drift.unwrap();
        let own = drift.variant.as_deref().zip(drift.parameters.first());
        let others = drift
            .elsewhere
            .iter()
            .filter_map(|other| Some((other.variant.as_str(), other.parameters.first()?)));
        let sensors: Vec<_> = own.into_iter().chain(others).collect();
        assert_eq!(sensors.len(), 4, "{sensors:?}");
        let (_, third) = sensors.iter().find(|s| s.0 == "sensor 3").unwrap();
        // k·u.
        assert!(
            (third.value - size).abs() < 3.0 * third.std,
            "{third:?}, {size}"
        );
        let said = &diagnosis.verdict.statement;
        assert!(said.contains("as likely sensor"), "{said}");
    }
}

/// A dead path that changes evenly looks like positions that are all too long: it must be listed
/// as hidden, not guessed.
#[test]
fn a_dead_path_hides() {
    let bare = maker("step-diagonal").diagnosed(&[], 3, &options(&[]));
    let hidden = bare
        .hidden
        .iter()
        .find(|h| h.effect == "dead-path")
        .unwrap();
    assert!(hidden.visible < 0.01, "{}", hidden.visible);
}

fn pontius() -> Option<Vec<CalibrationReading>> {
    let folder = std::env::var("ERRSEP_DATA").map_or_else(
        |_| std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        std::path::PathBuf::from,
    );
    let Ok(text) = std::fs::read_to_string(folder.join("nist_strd_linear/pontius.csv")) else {
        println!("skipped: nist_strd_linear/pontius.csv is not there (set ERRSEP_DATA)");
        return None;
    };
    let rows = text
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()));
    let readings = rows.map(|line| {
        let fields: Vec<f64> = line.split(',').map(|f| f.trim().parse().unwrap()).collect();
        CalibrationReading {
            x: fields[1],
            y: fields[2],
            set: fields[0] as u32,
            time: None,
        }
    });
    Some(readings.collect())
}

fn close(found: f64, known: f64, digits: i32) -> bool {
    (found / known - 1.0).abs() < 0.5 * 10f64.powi(1 - digits)
}

/// NIST StRD Pontius, a load cell: the figures known of it, to the digits known (other tool: NumPy).
#[test]
fn the_load_cell_of_pontius_is_bent_and_nothing_else_fits() {
    let Some(readings) = pontius() else { return };
    let model = CalibrationLine::new(&readings, None).unwrap();
    let column = |name: &str, shape: Option<f64>| {
        let effects = model.effects();
        let effect = effects.iter().find(|e| e.name() == name).unwrap();
        let mut at = effect.grid(&model).remove(0);
        if let Some(value) = shape {
            at.values = vec![value];
        }
        effect.columns(&model, &at)[0].dense(readings.len())
    };
    let line = model.lack_of_fit(&[]).unwrap();
    assert_eq!(line.freedom, [18.0, 20.0]);
    assert!(close(line.f, 214.75, 5), "{line:?}");
    assert!(close(line.pure_error, 2.147e-4, 4));
    let bent = model.lack_of_fit(&[column("quadratic", None)]).unwrap();
    assert!(close(bent.f, 0.8107, 4), "{bent:?}");
    assert!(close(bent.p_value, 0.6662, 4));
    assert!(close(line.residual / bent.residual, 10.58, 4));
    // The certified residual standard deviation of the quadratic.
    assert!(close(bent.residual, 0.205_177_424_076_185e-3, 10));
    for (name, shape, p) in [
        ("saturation", Some(0.5), 2.294e-4),
        ("cubic", None, 2.119e-5),
        ("square-root", None, 1.100e-9),
        ("logarithmic", None, 2.041e-12),
    ] {
        let other = model.lack_of_fit(&[column(name, shape)]).unwrap();
        assert!(close(other.p_value, p, 4), "{name}: {}", other.p_value);
        // All of them are significant beyond doubt against pure error: F of one column.
        let drop = (38.0 * line.residual.powi(2) - 37.0 * other.residual.powi(2))
            / line.pure_error.powi(2);
        assert!(drop > 3000.0, "{name}: {drop}");
    }
    // Fitted on the first set, squared errors on the second.
    let held_out = |bend: bool| {
        let half: Vec<_> = readings.iter().filter(|r| r.set == 1).copied().collect();
        let rest: Vec<_> = readings.iter().filter(|r| r.set == 2).copied().collect();
        let terms = |x: f64| {
            let t = x / model.reach();
            [1.0, t, if bend { t * t } else { 0.0 }]
        };
        let design = nalgebra::DMatrix::from_fn(half.len(), 3, |i, j| terms(half[i].x)[j]);
        let right = nalgebra::DVector::from_iterator(half.len(), half.iter().map(|r| r.y));
        let fit = design.svd(true, true).solve(&right, 1e-12).unwrap();
        let sum: f64 = rest
            .iter()
            .map(|r| (r.y - (0..3).map(|j| fit[j] * terms(r.x)[j]).sum::<f64>()).powi(2))
            .sum();
        (sum / rest.len() as f64).sqrt()
    };
    assert!(close(held_out(false), 2.075e-3, 4));
    assert!(close(held_out(true), 2.363e-4, 4));
}

/// The quadratic of the same data, blind: named alone; withheld, no single effect explains them.
#[test]
fn the_quadratic_of_pontius_is_named_and_withheld_no_other_alone_is_blamed() {
    let Some(readings) = pontius() else { return };
    let model = CalibrationLine::new(&readings, None).unwrap();
    let found = diagnose(&model, &options(&[]));
    assert_eq!(
        found.verdict.effects,
        ["quadratic"],
        "{}",
        found.verdict.statement
    );
    assert!(found.verdict.indistinguishable.is_empty());
    let slope = found.bias.iter().find(|b| b.quantity == "slope").unwrap();
    assert!(close(slope.moved / slope.before, 0.01379, 4), "{slope:?}");
    assert!(found.gap.shrink > 0.9, "{:?}", found.gap);
    let withheld = diagnose(&model, &options(&["quadratic"]));
    // One alone does not do; a root and a cube together bend as a square does.
    let kind = withheld.verdict.kind;
    assert!(
        kind == Kind::Unknown || withheld.verdict.effects.len() > 1,
        "{}",
        withheld.verdict.statement
    );
}

/// In the smallest size that readings are said to show with 80 % an effect is seen in as many. k·u: of 60, 48 are
/// expected, with a standard deviation of 3.1; three of them either way.
#[test]
fn what_is_put_in_at_the_size_told_is_seen_in_four_cases_of_five() {
    for (model, effect) in [("calibration-line", "cubic"), ("circle", "ovality")] {
        let maker = maker(model);
        let seen = (300..360).filter(|seed| {
            let bare = maker.diagnosed(&[], *seed, &options(&[]));
            // Readings that show it with nothing there, one in a hundred, tell no size.
            let own = bare.hidden.iter().find(|h| h.effect == effect);
            own.is_some_and(|own| {
                let put = [(effect, own.detectable.unwrap())];
                let with = maker.diagnosed(&put, *seed, &options(&[]));
                with.verdict.kind != Kind::None
            })
        });
        let seen = seen.count();
        assert!((39..=57).contains(&seen), "{model} {effect}: {seen} of 60");
    }
}

/// The greatest of the sizes by shape holds for a shape that shows badly: the maker's drift of a line fades with three
/// tenths of the duration. k·u: 16 of 20 expected at the least at a size that is seen with 80 %; 12 is more
/// than two standard deviations below. A drift of a laser does not show at all where it is soon over; what has one
/// shape tells none.
#[test]
fn sizes_by_shape_hold_shapes_that_show_badly() {
    let line = maker("calibration-line");
    let told = told_of(line, "drift", &options(&[]));
    let shapes = told.by_shape.expect("shapes of a drift are not alike");
    let greatest = shapes.to.expect("a plausible size");
    let middling = told.detectable.unwrap();
    assert!(shapes.from <= middling && middling < greatest, "{told:?}");
    let seen = (400..420).filter(|seed| {
        let diagnosis = line.diagnosed(&[("drift", greatest)], *seed, &options(&[]));
        diagnosis.verdict.kind != Kind::None
    });
    let seen = seen.count();
    assert!(seen >= 12, "{seen} of 20 at {greatest}");

    let of = |model, effect| told_of(maker(model), effect, &options(&[])).by_shape;
    assert_eq!(of("step-diagonal", "drift").unwrap().to, None);
    assert_eq!(of("circle", "ovality"), None);
}

/// What differs from repeat to repeat is taken for noise in part, and its size told as the least; what is the same in
/// all is not, nor is noise that is stated swollen by anything.
#[test]
fn a_size_is_told_as_the_least_where_repeats_differ_by_it() {
    let circle = maker("circle");
    for (effect, differs) in [
        ("part-moved", true),
        ("zero-jump", true),
        ("lobes", false),
        ("ovality", false),
    ] {
        let told = told_of(circle, effect, &options(&[]));
        assert_eq!(told.at_least, differs, "{effect}");
    }
    let points = circle_points(4);
    let stated = diagnose(
        &CirclePoints::new(&points, Some(1.0)).unwrap(),
        &options(&[]),
    );
    assert!(stated.hidden.iter().any(|h| h.detectable.is_some()));
    assert!(stated.hidden.iter().all(|h| !h.at_least));
}

/// A part that slips in its clamping in the middle of a pass, and stays there, has moved; from a drift of the centre and
/// from a pass that lies otherwise it is told, and what it does to the later passes does not pass for noise. k·u: four, of
/// a normal law, and a reading for the moment. The noise is that of the same points without the slip, but for what is left
/// of it by sizes known to 0.19 µm; where it passes for noise a part of 1 µm or more is correlated.
#[test]
fn a_part_that_slips_within_a_pass_is_told_with_its_moment() {
    let mut points = circle_points(4);
    for (point, _) in points.iter_mut().skip(100) {
        point.x += 12e-3;
        point.y -= 16e-3;
    }
    let model = CirclePoints::new(&points, None).unwrap();
    // Passes are cut open where they began.
    for pass in model.traces() {
        assert!(model.places()[pass.clone()].is_sorted_by_key(|place| place.time));
    }
    let found = diagnose(&model, &options(&[]));
    let verdict = &found.verdict;
    assert_eq!(verdict.effects, ["part-moved"], "{}", verdict.statement);
    let own = found.candidates.iter().find(|a| a.effect == "part-moved");
    let told = |name: &str| {
        let estimates = &own.unwrap().parameters;
        estimates.iter().find(|e| e.name == name).unwrap()
    };
    for (name, true_value) in [("along-x", 12.0), ("along-y", -16.0)] {
        let size = told(name);
        assert!((size.value - true_value).abs() < 4.0 * size.std, "{size:?}");
        assert!(size.std < 0.5, "{size:?}");
    }
    assert!(
        (told("time").value - 99.5).abs() < 1.0,
        "{:?}",
        told("time")
    );
    let bare = CirclePoints::new(&circle_points(4), None).unwrap();
    let bare = diagnose(&bare, &options(&[])).noise;
    for (with, without) in [
        (found.noise.white, bare.white),
        (found.noise.correlated, bare.correlated),
    ] {
        assert!((with - without).abs() < 0.2, "{with} {without}");
    }
}

/// *k·u*, two: of a part that slips at a moment and in a direction at random the moment lies within twice its printed
/// uncertainty. Of thirty at 95 % fewer than 26 do in one case of a hundred; the spacing of the points alone held 19 of 28.
#[test]
fn the_moment_of_a_slip_is_as_sure_as_it_is_told() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut told = Vec::new();
    for seed in 0..30 {
        let mut points = circle_points_of(4, 1000 * (seed + 1));
        let first = random.random_range(60..228);
        let along = random.random_range(0.0..std::f64::consts::TAU);
        for (point, _) in points.iter_mut().skip(first) {
            point.x += 5e-3 * along.cos();
            point.y += 5e-3 * along.sin();
        }
        let found = diagnose(&CirclePoints::new(&points, None).unwrap(), &options(&[]));
        if found.verdict.effects != ["part-moved"] {
            continue;
        }
        let own = found.candidates.iter().find(|c| c.effect == "part-moved");
        let moment = own.and_then(|c| c.parameters.iter().find(|p| p.name == "time"));
        told.extend(moment.map(|m| (m.value - (first as f64 - 0.5)).abs() <= 2.0 * m.std));
    }
    let within = told.iter().filter(|within| **within).count();
    assert!(told.len() >= 24, "{} of 30 named", told.len());
    assert!(within + 4 >= told.len(), "{within} of {}", told.len());
}

/// Passes of 72 points with 1 µm of noise.
fn circle_points(passes: usize) -> Vec<(Point, u32)> {
    circle_points_of(passes, 0)
}

/// The same of another seed.
fn circle_points_of(passes: usize, seed: u64) -> Vec<(Point, u32)> {
    let what = |pass| CircleSimulation {
        count: 72,
        noise_um: 1.0,
        pass: (pass, passes),
        ..CircleSimulation::default()
    };
    (0..passes)
        .flat_map(|pass| {
            let points = circle::simulate_disturbed(&what(pass), &[], seed + pass as u64).unwrap();
            points.into_iter().map(move |p| (p, pass as u32 + 1))
        })
        .collect()
}
