//! What the paper says of the test, and what the regression makes of it.

use errsep_models::diagonal::{
    Assumptions, Axis, Component, Determined, Diagonal, DiagonalReading, DiagonalSimulation,
    ErrorTables, Measured, Sequence, Target, Travel, WorkZone, choose_sequences, closed_forms,
    determined_by, identifiability, predicted_reading, regress, simulate,
};
use errsep_models::uncertainty::DegreesOfFreedom;
use nalgebra::Vector3;

fn zone(steps: usize) -> WorkZone {
    WorkZone {
        travel: [600.0, 480.0, 360.0],
        steps,
    }
}

fn plane_runs(target: Target) -> Vec<(Diagonal, Target, Sequence)> {
    let mut runs = Vec::new();
    for diagonal in Diagonal::FACE {
        for sequence in [Sequence::XYZ, Sequence::YXZ] {
            runs.push((diagonal, target, sequence));
        }
    }
    runs
}

fn body_runs(target: Target, sequences: &[Sequence]) -> Vec<(Diagonal, Target, Sequence)> {
    let mut runs = Vec::new();
    for diagonal in Diagonal::BODY {
        runs.extend(sequences.iter().map(|&s| (diagonal, target, s)));
    }
    runs
}

#[test]
fn plane_has_five_combinations_for_each_new_point() {
    for target in [Target::Mirror, Target::RetroReflector] {
        let found = identifiability(&zone(6), &plane_runs(target)).unwrap();
        assert_eq!(found.readings, 48, "{target:?}");
        // 6 functions of 7 nodes, a squareness and two mirror angles; yaw of Y turns a retro-reflector
        // only about itself.
        let touched = if target == Target::Mirror { 45 } else { 38 };
        assert_eq!(found.parameters, touched, "{target:?}");
        assert_eq!(found.rank, 30, "{target:?}");
        assert_eq!(found.defined_rank, 30, "definitions must cost nothing");
    }
}

#[test]
fn definitions_cost_nothing_in_three_dimensions() {
    for target in [Target::Mirror, Target::RetroReflector] {
        for sequences in [
            &Sequence::STEPS[..],
            &[Sequence::XYZ],
            &[Sequence::Together],
        ] {
            let found = identifiability(&zone(4), &body_runs(target, sequences)).unwrap();
            assert_eq!(found.rank, found.defined_rank, "{target:?} {sequences:?}");
        }
    }
}

/// Names by how they are determined.
fn names(zone: &WorkZone, runs: &[(Diagonal, Target, Sequence)], wanted: &[Determined]) -> String {
    determined_by(zone, runs)
        .unwrap()
        .iter()
        .filter(|(_, d)| wanted.contains(d))
        .map(|(c, _)| c.name())
        .collect::<Vec<_>>()
        .join(" ")
}

const SEEN: [Determined; 2] = [Determined::Wholly, Determined::ShapeOnly];

/// The rows of the fixture: target, sequences, names of the angular and translational errors.
#[test]
fn rank_says_what_each_test_determines() {
    let table = include_str!("../../../fixtures/step_diagonal/determined.csv");
    let mut rows = 0;
    for row in table.lines().skip(1) {
        let [target, sequences, angular, translational] =
            row.split(',').collect::<Vec<_>>().try_into().unwrap();
        let target = match target {
            "mirror" => Target::Mirror,
            _ => Target::RetroReflector,
        };
        let sequences: Vec<Sequence> = sequences
            .split(' ')
            .map(|s| Sequence::from_name(s).unwrap())
            .collect();
        let mut expected: Vec<&str> = angular.split(' ').chain(translational.split(' ')).collect();
        expected.retain(|name| !name.is_empty());
        expected.sort_unstable();
        let found = names(&zone(4), &body_runs(target, &sequences), &SEEN);
        let mut found: Vec<&str> = found.split(' ').collect();
        found.sort_unstable();
        assert_eq!(found, expected, "{row}");
        rows += 1;
    }
    assert_eq!(rows, 3);
}

#[test]
fn a_retro_reflector_does_not_see_the_tool_turn() {
    let runs = body_runs(Target::RetroReflector, &Sequence::STEPS);
    assert_eq!(
        names(&zone(4), &runs, &[Determined::NotTouched]),
        "ECY EAZ EBZ ECZ"
    );
}

#[test]
fn positioning_keeps_its_slope_open() {
    let mirror = body_runs(Target::Mirror, &Sequence::STEPS);
    assert_eq!(names(&zone(4), &mirror, &[Determined::ShapeOnly]), "EZZ");
    let retro = body_runs(Target::RetroReflector, &Sequence::STEPS);
    assert_eq!(
        names(&zone(4), &retro, &[Determined::ShapeOnly]),
        "EXX EYY EZZ"
    );
}

#[test]
fn choice_of_the_sequences() {
    let choices = choose_sequences(&zone(4), &Diagonal::BODY, &[Target::Mirror]).unwrap();
    assert_eq!(choices.len(), 6);
    let angular: Vec<usize> = choices.iter().map(|c| c.angular.len()).collect();
    assert_eq!(angular.first(), Some(&0));
    assert_eq!(angular.last(), Some(&5));
    assert!(angular.windows(2).all(|w| w[0] <= w[1]), "{angular:?}");
    println!("angular errors by number of sequences: {angular:?}");
    // The first number of sequences that reaches all five.
    let enough = choices.iter().find(|c| c.angular.len() == 5).unwrap();
    assert!(enough.sequences.len() < 6, "{enough:?}");
}

/// Readings of the linear model without noise.
fn linear(
    zone: &WorkZone,
    tables: &ErrorTables,
    runs: &[(Diagonal, Target, Sequence)],
    mirror: impl Fn(Diagonal) -> f64,
) -> Vec<DiagonalReading> {
    let mut readings = Vec::new();
    for &(diagonal, target, sequence) in runs {
        let mut stops = zone.stops(diagonal, sequence);
        stops.dedup();
        for at in stops {
            let misaligned = Vector3::new(0.0, 0.0, mirror(diagonal));
            readings.push(DiagonalReading {
                diagonal,
                target,
                sequence,
                repeat: 1,
                travel: Travel::Forward,
                at,
                value: predicted_reading(
                    zone,
                    tables,
                    diagonal,
                    target,
                    misaligned,
                    at,
                    Travel::Forward,
                ),
            });
        }
    }
    readings
}

fn profile(readings: &[DiagonalReading], zone: &WorkZone, equation: &str) -> Vec<f64> {
    closed_forms(zone, readings)
        .unwrap()
        .into_iter()
        .find(|f| f.equation == equation)
        .unwrap()
        .profile
}

#[test]
fn mirror_misalignment_is_a_slope_and_cannot_be_detected() {
    let zone = zone(6);
    let (em1, em2) = (60e-6, -30e-6);
    let readings = linear(
        &zone,
        &ErrorTables::zero(&zone),
        &plane_runs(Target::Mirror),
        |d| {
            if d == Diagonal::AC { em1 } else { em2 }
        },
    );
    let (x, y) = (
        profile(&readings, &zone, "(19)"),
        profile(&readings, &zone, "(20)"),
    );
    for i in 0..=6 {
        let share = i as f64 / 6.0;
        // −(em1 − em2) ΔY/2 for X and +(em1 − em2) ΔX/2 for Y; tolerance: epsilons of 30 µm.
        let expected = 0.5e3 * (em1 - em2) * share;
        assert!((x[i] + expected * zone.travel[1]).abs() < 1e-12);
        assert!((y[i] - expected * zone.travel[0]).abs() < 1e-12);
    }
    // They cancel on the diagonal: nx X + ny Y = 0.
    let n = Diagonal::AC.direction(&zone);
    assert!((n.x * x[6] + n.y * y[6]).abs() < 1e-12);
    // Whatever the misalignment, the same residuals: nothing is left to detect.
    let fit = regress(&zone, &readings, &Assumptions::default()).unwrap();
    assert!(fit.residuals.iter().all(|r| r.abs() < 1e-9));
    assert!(fit.mirrors.iter().any(|m| m.value.is_none()));
    println!("{:#?}", fit.ambiguities);
    assert!(
        fit.ambiguities.iter().any(|a| a.statement
            == "positioning slope of X (EXX), positioning slope of Y (EYY) and mirror misalignment cannot be told apart: measure one slope"),
    );
}

#[test]
fn one_measured_slope_settles_the_other_and_the_mirror_difference() {
    let what = DiagonalSimulation {
        zone: zone(6),
        diagonals: Diagonal::FACE.to_vec(),
        sequences: vec![Sequence::XYZ, Sequence::YXZ],
        noise: 0.0,
        ..DiagonalSimulation::default()
    };
    let (readings, tables, _) = simulate(&what, 3);
    let truth = |name: &str| tables.of(Component::from_name(name).unwrap())[6];
    let angular: Vec<Component> = ["ECX"]
        .iter()
        .map(|n| Component::from_name(n).unwrap())
        .collect();
    let mut known = tables.clone();
    for value in known.of_mut(angular[0]) {
        *value = 0.0;
    }
    let readings: Vec<DiagonalReading> =
        linear(&what.zone, &known, &plane_runs(Target::Mirror), |d| {
            if d == Diagonal::AC { 70e-6 } else { 10e-6 }
        })
        .into_iter()
        .take(readings.len())
        .collect();
    let unsettled = Assumptions {
        zero: angular.clone(),
        noise: Some(0.1),
        ..Assumptions::default()
    };
    let kind = |a: &Assumptions, name: &str| {
        let component = Component::from_name(name).unwrap();
        regress(&what.zone, &readings, a).unwrap().components[component.index()].clone()
    };
    assert_eq!(kind(&unsettled, "EXX").determined, Determined::ShapeOnly);
    assert_eq!(kind(&unsettled, "EYY").determined, Determined::ShapeOnly);
    let settled = Assumptions {
        slopes: vec![Measured {
            axis: Axis::X,
            slope: truth("EXX") / what.zone.travel[0],
            std: 1e-5,
            degrees_of_freedom: DegreesOfFreedom::Infinite,
        }],
        ..unsettled
    };
    for name in ["EXX", "EYY", "EYX", "EXY", "ECY"] {
        let estimate = kind(&settled, name);
        assert_eq!(estimate.determined, Determined::Wholly, "{name}");
        let component = Component::from_name(name).unwrap();
        for (i, value) in estimate.values.iter().enumerate() {
            let size = if component.rotation { 1e-6 } else { 1.0 };
            // Tolerance: rounding of a regression with condition below 1e5.
            assert!(
                (value - known.of(component)[i]).abs() < 1e-9 * size,
                "{name} {i}: {value} {}",
                known.of(component)[i]
            );
        }
    }
}

#[test]
fn twenty_microradian_and_the_square_root_of_the_steps() {
    // 100 mm steps; u(dd) = 1 µm is a reading of 1/√2 µm. Equation (18): √2 u(dd)/(nx ny d).
    let zone = WorkZone {
        travel: [500.0, 500.0, 1.0],
        steps: 5,
    };
    let readings = linear(
        &zone,
        &ErrorTables::zero(&zone),
        &plane_runs(Target::Mirror),
        |_| 0.0,
    );
    let form = closed_forms(&zone, &readings)
        .unwrap()
        .into_iter()
        .find(|f| f.equation == "(14)")
        .unwrap();
    for gain in &form.step_gains {
        let u = gain / 2.0_f64.sqrt();
        assert!((u - 20e-6).abs() < 1e-18, "{u}");
    }
    for (i, gain) in form.profile_gains.iter().enumerate() {
        // Tolerance: epsilons; the steps share no reading.
        let u = gain / 2.0_f64.sqrt();
        assert!((u - 20e-6 * (i as f64).sqrt()).abs() < 1e-18, "{i} {u}");
    }
}

/// Height of a profile above the chord through its ends, at its middle.
fn sag(profile: &[f64]) -> f64 {
    profile[profile.len() / 2] - 0.5 * (profile[0] + profile[profile.len() - 1])
}

#[test]
fn yaw_of_x_bends_its_straightness() {
    // 1 µrad/m over 1 m: 1/4 µm with a mirror, because the variable offset adds as much as the
    // integrated yaw; 1/8 µm with a retro-reflector. Tolerance: truncation, one step in 200.
    let zone = WorkZone {
        travel: [1000.0, 1000.0, 1.0],
        steps: 200,
    };
    let mut tables = ErrorTables::zero(&zone);
    let yaw = Component::from_name("ECX").unwrap();
    for (i, value) in tables.of_mut(yaw).iter_mut().enumerate() {
        *value = 1e-6 * i as f64 / 200.0;
    }
    for (target, equation, expected) in [
        (Target::Mirror, "(21)", 0.25),
        (Target::RetroReflector, "(26)", 0.125),
    ] {
        let readings = linear(&zone, &tables, &plane_runs(target), |_| 0.0);
        let found = sag(&profile(&readings, &zone, equation)).abs();
        assert!(
            (found - expected).abs() < 0.02 * expected,
            "{equation} {found}"
        );
    }
}

#[test]
fn linear_yaw_of_y_leaves_no_slope_but_a_parabola_in_positioning() {
    // The text says its effect is zero; its slope is, but c ΔY²/8 remains: 0.125 µm for 1 µrad/m and 1 m.
    let zone = WorkZone {
        travel: [1000.0, 1000.0, 1.0],
        steps: 200,
    };
    let mut tables = ErrorTables::zero(&zone);
    let yaw = Component::from_name("ECY").unwrap();
    for (i, value) in tables.of_mut(yaw).iter_mut().enumerate() {
        *value = 1e-6 * i as f64 / 200.0;
    }
    let readings = linear(&zone, &tables, &plane_runs(Target::Mirror), |_| 0.0);
    let x = profile(&readings, &zone, "(19)");
    assert!(x[200].abs() < 1e-12);
    // c Δy²/8 with N steps: exact for the sum of an arithmetic series, tolerance epsilons.
    assert!((sag(&x).abs() - 0.125).abs() < 1e-3, "{}", sag(&x));
}

#[test]
fn mirror_misalignment_tilts_the_positioning_of_z() {
    // Minus the mean angle about the horizontal axis in the mirror times the XY diagonal.
    let zone = zone(5);
    let angle = 40e-6;
    let mut readings = Vec::new();
    for diagonal in Diagonal::BODY {
        let mirror = diagonal.mirror_axes(&zone)[0] * angle;
        for sequence in Sequence::STEPS {
            let mut stops = zone.stops(diagonal, sequence);
            stops.dedup();
            for at in stops {
                let value = predicted_reading(
                    &zone,
                    &ErrorTables::zero(&zone),
                    diagonal,
                    Target::Mirror,
                    mirror,
                    at,
                    Travel::Forward,
                );
                readings.push(DiagonalReading {
                    diagonal,
                    target: Target::Mirror,
                    sequence,
                    repeat: 1,
                    travel: Travel::Forward,
                    at,
                    value,
                });
            }
        }
    }
    let z = profile(&readings, &zone, "(35)");
    let plane = zone.travel[0].hypot(zone.travel[1]);
    assert!(
        (z[5].abs() - 1e3 * angle * plane).abs() < 1e-9,
        "{} {}",
        z[5],
        1e3 * angle * plane
    );
}

#[test]
fn regression_recovers_what_it_calls_determined_and_its_uncertainty_holds() {
    let what = DiagonalSimulation {
        zone: zone(4),
        targets: vec![Target::Mirror, Target::RetroReflector],
        noise: 0.2,
        ..DiagonalSimulation::default()
    };
    let (mut squares, mut count) = (0.0, 0.0_f64);
    for seed in 0..8 {
        let (readings, tables, _) = simulate(&what, seed);
        let assumptions = Assumptions {
            noise: Some(0.2),
            ..Assumptions::default()
        };
        let fit = regress(&what.zone, &readings, &assumptions).unwrap();
        for estimate in &fit.components {
            let truth = tables.of(estimate.component);
            let chord = |i: usize| match estimate.determined {
                Determined::ShapeOnly => truth[4] * i as f64 / 4.0,
                _ => 0.0,
            };
            if !SEEN.contains(&estimate.determined) {
                continue;
            }
            for i in 0..=4 {
                if estimate.std[i] > 0.0 {
                    squares +=
                        ((estimate.values[i] - truth[i] + chord(i)) / estimate.std[i]).powi(2);
                    count += 1.0;
                }
            }
        }
    }
    let ratio = squares / count;
    println!("mean squared normalised error {ratio:.3} of {count}");
    // Tolerance: k·u of a mean square; values of one run are correlated, so that some 200 of the
    // {count} are independent: 3 √(2/200) = 0.3.
    assert!((ratio - 1.0).abs() < 0.3, "{ratio}");
}

#[test]
fn noise_is_estimated_from_the_redundancy() {
    let what = DiagonalSimulation {
        zone: zone(5),
        noise: 0.3,
        ..DiagonalSimulation::default()
    };
    let (readings, _, _) = simulate(&what, 11);
    let fit = regress(&what.zone, &readings, &Assumptions::default()).unwrap();
    let nu = fit.degrees_of_freedom as f64;
    // Tolerance: k·u, 3/√(2ν).
    assert!(
        (fit.noise.unwrap() / 0.3 - 1.0).abs() < 3.0 / (2.0 * nu).sqrt(),
        "{:?} {nu}",
        fit.noise
    );
}
