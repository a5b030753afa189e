//! Runs there and back: reversal of the errors, and the degrees of freedom of what slopes settle.

use errsep_models::diagonal::{
    Assumptions, Axis, Component, Determined, Diagonal, DiagonalReading, DiagonalSimulation,
    ErrorTables, Measured, Motion, Sequence, Target, Travel, WorkZone, closed_forms, exact_reading,
    predicted_reading, regress, simulate, totals,
};
use errsep_models::uncertainty::DegreesOfFreedom;
use nalgebra::Vector3;

fn there_and_back(steps: usize) -> DiagonalSimulation {
    DiagonalSimulation {
        zone: WorkZone {
            travel: [600.0, 480.0, 360.0],
            steps,
        },
        backward: true,
        reversal: 2.0,
        reversal_rotation: 10e-6,
        noise: 0.1,
        ..DiagonalSimulation::default()
    }
}

fn names(fit: &errsep_models::diagonal::StepDiagonalFit, wanted: Determined) -> String {
    let found = fit.reversals.iter().filter(|c| c.determined == wanted);
    found
        .map(|c| c.component.name())
        .collect::<Vec<_>>()
        .join(" ")
}

#[test]
fn linear_model_of_the_way_back_is_that_of_exact_geometry() {
    let what = there_and_back(3);
    let (_, tables, _) = simulate(&what, 4);
    let mut reversed = tables.clone();
    for f in reversed.functions.iter_mut().chain(&mut reversed.reversals) {
        f.iter_mut().for_each(|v| *v = -*v);
    }
    reversed.squareness = reversed.squareness.map(|s| -s);
    let mirror = Vector3::new(40e-6, -30e-6, 50e-6);
    for target in [Target::Mirror, Target::RetroReflector] {
        for diagonal in Diagonal::ALL {
            for sequence in Sequence::STEPS {
                for at in what.zone.stops(diagonal, sequence) {
                    for travel in Travel::ALL {
                        let exact = |t: &ErrorTables, m| {
                            exact_reading(&what.zone, t, diagonal, target, m, at, travel)
                        };
                        let odd = 0.5 * (exact(&tables, mirror) - exact(&reversed, -mirror));
                        let linear = predicted_reading(
                            &what.zone, &tables, diagonal, target, mirror, at, travel,
                        );
                        // Truncation: the third order of 60 µrad at 600 mm.
                        assert!(
                            (odd - linear).abs() < 1e-6,
                            "{target:?} {diagonal:?} {at:?} {travel:?}: {odd} {linear}"
                        );
                    }
                }
            }
        }
    }
}

/// What the way back determines on four body diagonals in all six sequences.
#[test]
fn the_way_back_determines_changes_of_the_reversal() {
    for (target, wholly, changes) in [
        (Target::Mirror, "EBY ECZ", "ECY EZZ EAZ EBZ"),
        (
            Target::RetroReflector,
            "EAX EBY",
            "EXX EYX EZX EBX ECX EXY EZY EAY EXZ EYZ",
        ),
    ] {
        let what = DiagonalSimulation {
            targets: vec![target],
            ..there_and_back(4)
        };
        let (readings, _, _) = simulate(&what, 4);
        let fit = regress(&what.zone, &readings, &Assumptions::default()).unwrap();
        assert_eq!(names(&fit, Determined::Wholly), wholly, "{target:?}");
        assert_eq!(names(&fit, Determined::ChangesOnly), changes, "{target:?}");
        // The errors themselves are the means of both ways: as well determined as without.
        let forward: Vec<DiagonalReading> = readings
            .into_iter()
            .filter(|r| r.travel == Travel::Forward)
            .collect();
        let alone = regress(&what.zone, &forward, &Assumptions::default()).unwrap();
        assert!(alone.reversals.is_empty());
        for (with, without) in fit.components.iter().zip(&alone.components) {
            assert_eq!(with.determined, without.determined, "{:?}", with.component);
        }
        assert_eq!(fit.ambiguities, alone.ambiguities);
    }
}

#[test]
fn reversals_are_found_within_their_uncertainty() {
    let what = DiagonalSimulation {
        targets: vec![Target::Mirror, Target::RetroReflector],
        ..there_and_back(3)
    };
    let (mut squares, mut count) = (0.0, 0.0_f64);
    for seed in 0..12 {
        let (readings, tables, _) = simulate(&what, seed);
        let assumptions = Assumptions {
            noise: Some(what.noise),
            ..Assumptions::default()
        };
        let fit = regress(&what.zone, &readings, &assumptions).unwrap();
        for estimate in &fit.reversals {
            let truth = tables.reversal_of(estimate.component);
            let first = match estimate.determined {
                Determined::Wholly => 0.0,
                Determined::ChangesOnly => truth[0],
                _ => continue,
            };
            for ((value, std), truth) in estimate.values.iter().zip(&estimate.std).zip(truth) {
                if *std > 0.0 {
                    squares += ((value - truth + first) / std).powi(2);
                    count += 1.0;
                }
            }
        }
    }
    let ratio = squares / count;
    println!("mean squared normalised error {ratio:.3} of {count}");
    // Tolerance: k·u of a mean square of correlated values, some 200 of them independent: 3 √(2/200).
    assert!(count > 500.0 && (ratio - 1.0).abs() < 0.3, "{ratio}");
}

#[test]
fn one_sense_of_motion_gives_the_unidirectional_error() {
    // (35) from motions of Z in one sense only: up on the way there, down on the way back.
    let what = DiagonalSimulation {
        diagonals: Diagonal::BODY.to_vec(),
        noise: 0.0,
        mirror: 0.0,
        rotation: 0.0,
        reversal_rotation: 0.0,
        translation: 1e-3,
        reversal: 1e-3,
        ..there_and_back(4)
    };
    let (readings, tables, _) = simulate(&what, 9);
    let z = Component::from_name("EZZ").unwrap();
    let forms = closed_forms(&what.zone, &readings).unwrap();
    for (motion, sign) in [
        (Motion::Either, 0.0),
        (Motion::Positive, 0.5),
        (Motion::Negative, -0.5),
    ] {
        let form = forms
            .iter()
            .find(|f| f.equation == "(35)" && f.motion == motion)
            .unwrap();
        let one = |i: usize| tables.of(z)[i] + sign * tables.reversal_of(z)[i];
        for (i, value) in form.profile.iter().enumerate() {
            // Truncation: the second order of 1e-3 µm and of the squareness, which is zero here, over
            // 360 mm is below 1e-10 µm.
            let truth = one(i) - one(0);
            assert!(
                (value - truth).abs() < 1e-9,
                "{motion:?} {i}: {value} {truth}"
            );
        }
    }
}

#[test]
fn a_diagonal_there_and_back_gives_the_sum_of_the_reversals() {
    let what = DiagonalSimulation {
        sequences: vec![Sequence::Together],
        noise: 0.0,
        mirror: 0.0,
        translation: 0.0,
        rotation: 0.0,
        reversal_rotation: 0.0,
        ..there_and_back(4)
    };
    let (_, mut tables, _) = simulate(&what, 2);
    for f in &mut tables.reversals {
        f.fill(0.0);
    }
    // Backlash of 3 µm in X, 2 µm in Y and 1 µm in Z: nx 3 + ny 2 + nz 1 on every body diagonal.
    for (name, backlash) in [("EXX", 3.0), ("EYY", 2.0), ("EZZ", 1.0)] {
        let component = Component::from_name(name).unwrap();
        tables.reversal_of_mut(component).fill(backlash);
    }
    let mut readings = Vec::new();
    for diagonal in Diagonal::BODY {
        for travel in Travel::ALL {
            for at in what.zone.stops(diagonal, Sequence::Together) {
                let value = exact_reading(
                    &what.zone,
                    &tables,
                    diagonal,
                    Target::Mirror,
                    Vector3::zeros(),
                    at,
                    travel,
                );
                readings.push(DiagonalReading {
                    diagonal,
                    target: Target::Mirror,
                    sequence: Sequence::Together,
                    repeat: 1,
                    travel,
                    at,
                    value,
                });
            }
        }
    }
    let n = Diagonal::AG.direction(&what.zone);
    let found = totals(&what.zone, &readings).unwrap().reversals;
    assert_eq!(found.len(), 4);
    for value in found.values() {
        // Tolerance: rounding of lengths of 1 m in µm.
        assert!(
            (value - n.dot(&Vector3::new(3.0, 2.0, 1.0))).abs() < 1e-8,
            "{value}"
        );
    }
}

#[test]
fn a_measured_slope_brings_its_degrees_of_freedom() {
    // In the plane the positioning of Y at its far end rests on the slope of X and on the readings.
    let what = DiagonalSimulation {
        diagonals: Diagonal::FACE.to_vec(),
        sequences: vec![Sequence::XYZ, Sequence::YXZ],
        backward: false,
        ..there_and_back(6)
    };
    let (readings, tables, _) = simulate(&what, 3);
    let yaw = Component::from_name("ECX").unwrap();
    let travel = what.zone.travel[0];
    let fit = |std: f64, degrees_of_freedom| {
        let x = tables.of(Component::from_name("EXX").unwrap());
        let assumptions = Assumptions {
            zero: vec![yaw],
            slopes: vec![Measured {
                axis: Axis::X,
                slope: x[6] / travel,
                std,
                degrees_of_freedom,
            }],
            noise: None,
        };
        regress(&what.zone, &readings, &assumptions).unwrap()
    };
    let five = DegreesOfFreedom::Finite(5.0);
    let end = |fit: &errsep_models::diagonal::StepDiagonalFit, name: &str| {
        let c = &fit.components[Component::from_name(name).unwrap().index()];
        (c.std[6], c.degrees_of_freedom[6].as_f64())
    };
    let exact = fit(1e-9, five);
    let of_noise = exact.noise_degrees_of_freedom.unwrap().as_f64();
    // Limits: a slope without uncertainty leaves the noise alone, one that swamps it its own 5.
    let (u_noise, degrees) = end(&exact, "EYY");
    assert!((degrees / of_noise - 1.0).abs() < 1e-6, "{degrees}");
    let (u_x, degrees) = end(&exact, "EXX");
    assert!((u_x / (1e-9 * travel) - 1.0).abs() < 1e-6, "{u_x}");
    assert!((degrees - 5.0).abs() < 1e-6, "{degrees}");
    let (_, degrees) = end(&fit(1.0, five), "EYY");
    assert!((degrees - 5.0).abs() < 1e-3, "{degrees}");
    // Between them Welch–Satterthwaite of the two, which are independent.
    let std = 1e-3;
    let (u, degrees) = end(&fit(std, five), "EYY");
    // ny Y + nx X is fixed by the diagonals: the slope of X enters Y by −nx/ny.
    let n = Diagonal::AC.direction(&what.zone);
    let from_slope = n.x / n.y * std * travel;
    assert!((u.powi(2) / (u_noise.powi(2) + from_slope.powi(2)) - 1.0).abs() < 1e-6);
    let expected = u.powi(4) / (u_noise.powi(4) / of_noise + from_slope.powi(4) / 5.0);
    // Tolerance: rounding of a regression with condition below 1e5.
    assert!(
        (degrees / expected - 1.0).abs() < 1e-6,
        "{degrees} {expected}"
    );
    let (_, degrees) = end(&fit(1.0, DegreesOfFreedom::Infinite), "EYY");
    assert!(degrees > 1e6, "{degrees}");
}
