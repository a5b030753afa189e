//! The size from which an effect is seen, as data without it tell it, and the moment of one that begins within a pass.

use errsep::diagnosis::{Kind, diagnose};
use errsep_models::circle::{self, CirclePoints, CircleSimulation, Point};
use errsep_models::model::{FittedModel, Shape};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::simulate::{Plan, simulate};
use errsep_models::reversal::{Direction, Observations};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::models::{maker, options, told};

/// In the smallest size that readings are said to show with 80 % an effect is seen in as many. k·u: of 48, 38 are
/// expected, with a standard deviation of 2.8; three of them either way. The campaign `other_models` counts every
/// effect.
#[test]
fn what_is_put_in_at_the_size_told_is_seen_in_four_cases_of_five() {
    let seen = |model, effect, seeds: std::ops::Range<u64>| {
        let maker = maker(model);
        let put = [(effect, told(maker, effect).detectable.unwrap())];
        let seen = seeds.filter(|seed| {
            let diagnosis = maker.diagnosed(&put, *seed, &options(&[]));
            diagnosis.verdict.kind != Kind::None
        });
        seen.count()
    };
    let of = [
        seen("calibration-line", "cubic", 300..324),
        seen("circle", "ovality", 300..324),
    ];
    let both = of[0] + of[1];
    assert!((30..=46).contains(&both), "{of:?} of 24 each");
}

/// The greatest of the sizes by shape holds for a shape that shows badly: the maker's drift of a line fades with three
/// tenths of the duration. k·u: 16 of 20 expected at the least at a size that is seen with 80 %; 12 is more
/// than two standard deviations below. A drift of a laser does not show at all where it is soon over; what has one
/// shape tells none.
#[test]
fn sizes_by_shape_hold_shapes_that_show_badly() {
    let line = maker("calibration-line");
    let drift = told(line, "drift");
    let shapes = drift.by_shape.expect("shapes of a drift are not alike");
    let greatest = shapes.to.expect("a plausible size");
    let middling = drift.detectable.unwrap();
    assert!(shapes.from <= middling && middling < greatest, "{drift:?}");
    let seen = (400..420).filter(|seed| {
        let diagnosis = line.diagnosed(&[("drift", greatest)], *seed, &options(&[]));
        diagnosis.verdict.kind != Kind::None
    });
    let seen = seen.count();
    assert!(seen >= 12, "{seen} of 20 at {greatest}");

    let of = |model, effect| told(maker(model), effect).by_shape;
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
        let told = told(circle, effect);
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

/// *k·u*: how often a slide slips that leans as it sticks, from a state of its own in each pass, is told by between which readings
/// it slips; what changes evenly from slip to slip passes for the tilt of the slide. The sawtooth put in is the catalogue's own. Eight seeds: in each within 3.5 printed
/// uncertainties, which are less than a hundredth of a slip; without what the falls tell they were 10⁹ or zero, and the tilt as unsure.
#[test]
fn slips_are_as_sure_as_they_are_told() {
    let mut named = 0;
    for seed in 0..8 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let plan = Plan {
            repeats: 4,
            seed,
            ..Plan::even(0.0, 300.0, 151, 0.02)
        };
        let model = Linearised::new(&both_ways(&plan), Assumptions::default()).unwrap();
        let catalogue = model.effects();
        let effect = catalogue.iter().find(|e| e.name() == "stick-slip").unwrap();
        // The first waves of a lean have a value for each pass; the sawtooth is the variant after them.
        let waves = effect
            .grid(&model)
            .into_iter()
            .find(|s| s.variant == 1)
            .unwrap();
        let mut shape = Shape {
            variant: 2,
            ..waves
        };
        let slips = random.random_range(6.0..14.0);
        shape.values[0] = slips;
        for state in &mut shape.values[1..] {
            *state = random.random_range(0.0..1.0);
        }
        let mut readings = model.linearised();
        for column in effect.columns(&model, &shape) {
            for (&row, &value) in column.rows.iter().zip(&column.values) {
                readings[row] += 0.1 * value;
            }
        }
        let found = diagnose(&model.refit(readings), &options(&[]));
        if found.verdict.effects != ["stick-slip"] {
            continue;
        }
        named += 1;
        let own = found
            .candidates
            .iter()
            .find(|c| c.effect == "stick-slip")
            .unwrap();
        let told = own.parameters.iter().find(|p| p.name == "slips").unwrap();
        assert!(
            (told.value - slips).abs() < 3.5 * told.std && told.std < 0.01 * slips,
            "{slips} {told:?}"
        );
        let alpha = found.bias.iter().find(|b| b.quantity == "alpha").unwrap();
        assert!(alpha.moved_std < 1e-7, "{alpha:?}");
    }
    assert!(named >= 6, "{named} of 8 named");
}

/// The readings of a plan forward and as many of another seed backward, each pass a minute long.
fn both_ways(plan: &Plan) -> Observations {
    let of = |direction: Direction, seed: u64| {
        let plan = Plan {
            seed,
            ..plan.clone()
        };
        let (mut made, _) = simulate(&plan, &[]).unwrap();
        for reading in &mut made.readings {
            let (pass, back) = match direction {
                Direction::Forward => (2 * reading.repeat, reading.x / 300.0),
                Direction::Backward => (2 * reading.repeat + 1, 1.0 - reading.x / 300.0),
            };
            reading.direction = direction;
            reading.time = Some(60.0 * (f64::from(pass) + back));
        }
        made.readings
    };
    let mut readings = of(Direction::Forward, plan.seed);
    readings.extend(of(Direction::Backward, plan.seed + 1000));
    Observations { readings }
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
