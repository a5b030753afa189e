//! The regression by levels is that by one dense matrix.

use super::design::{Design, Function, is_definition, nodes_of};
use super::determination::{ambiguities, determination, end_slope, remedies};
use super::estimates::{Assumptions, ComponentEstimate, Measured, StepDiagonalFit};
use super::prediction::Parameter;
use super::regression::functionals;
use super::solution::{SlopeRow, Solution};
use super::undetermined::Undetermined;
use super::{
    Axis, Component, Determined, Diagonal, DiagonalReading, DiagonalSimulation, Sequence, Target,
    WorkZone, regress, simulate,
};
use crate::uncertainty::DegreesOfFreedom;
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// exact limit: rounding over a condition of 1e4 or so, of what a function reaches.
const EQUAL: f64 = 1e-9;

struct Dense {
    design: Design,
    parameters: DVector<f64>,
    solution: Solution,
    null: Undetermined,
}

/// The least squares of least norm of the whole matrix, as for a small one.
fn dense(
    zone: &WorkZone,
    readings: &[DiagonalReading],
    assumptions: &Assumptions,
    noise: f64,
) -> Dense {
    let design = Design::of(zone, readings, |p| {
        !is_definition(p, zone.steps)
            && !matches!(p, Parameter::Node(c, _) | Parameter::Reversal(c, _)
                if assumptions.zero.contains(&c))
    });
    let mut observed = DVector::from_iterator(readings.len(), readings.iter().map(|r| r.value));
    design.free_of_zero(&mut observed);
    let matrix = design.dense();
    let mut solution = Solution::of_readings(&matrix, &observed, 0.0).unwrap();
    let mut parameters = solution.parameters.clone();
    let left = &observed - &matrix * &parameters;
    let again = Solution::of_readings(&matrix, &left, 0.0).unwrap();
    parameters += again.parameters;
    let slopes: Vec<SlopeRow> = assumptions
        .slopes
        .iter()
        .filter_map(|m| {
            let travel = zone.travel[m.axis.index()];
            let (place, gradient) = end_slope(&design.unknowns, m.axis, travel, zone.steps)?;
            Some(SlopeRow {
                column: place,
                coefficient: noise / m.std * gradient * design.scale[place],
                value: noise / m.std * m.slope,
                degrees_of_freedom: m.degrees_of_freedom,
            })
        })
        .collect();
    if !slopes.is_empty() {
        solution = solution.joined(&matrix, &observed, &slopes).unwrap();
        parameters = solution.parameters.clone();
    }
    let columns: Vec<DVector<f64>> = solution.null.column_iter().map(|c| c.into()).collect();
    let null = Undetermined::of(parameters.len(), std::iter::empty(), &columns).unwrap();
    Dense {
        design,
        parameters,
        solution,
        null,
    }
}

fn same(ours: f64, theirs: f64, size: f64, what: &str) {
    assert!(
        (ours - theirs).abs() <= EQUAL * size,
        "{what}: {ours:e} instead of {theirs:e}"
    );
}

fn compare_function(dense: &Dense, function: Function, found: &ComponentEstimate, noise: f64) {
    let name = format!("{function:?}");
    let (determined, lost) = determination(&dense.design.unknowns, &dense.null, function).unwrap();
    assert_eq!(found.determined, determined, "{name}");
    let nodes = nodes_of(&dense.design.unknowns, function);
    let Some(told) = functionals(function, determined, &nodes, &lost) else {
        return;
    };
    let rows: Vec<usize> = nodes.iter().map(|n| n.0).collect();
    let scale = dense.design.scale[rows[0]];
    let values = &told * dense.parameters.select_rows(&rows) * scale;
    let halves = &told * dense.solution.half_covariance.select_rows(&rows) * scale * noise;
    let largest = halves.row_iter().map(|h| h.norm()).fold(0.0, f64::max);
    let reach = values.amax().max(largest);
    for (k, &(_, index)) in nodes.iter().enumerate() {
        same(found.values[index], values[k], reach, &name);
        same(found.std[index], halves.row(k).norm(), largest, &name);
    }
}

/// Whether all of a regression is that of the dense matrix.
fn compare(zone: &WorkZone, readings: &[DiagonalReading], assumptions: &Assumptions) {
    let fit: StepDiagonalFit = regress(zone, readings, assumptions).unwrap();
    let noise = fit.noise.unwrap();
    let dense = dense(zone, readings, assumptions, noise);
    assert_eq!(fit.rank, dense.solution.rank());
    assert_eq!(
        fit.ambiguities,
        ambiguities(&dense.design.unknowns, &dense.null)
    );
    assert_eq!(fit.remedies, remedies(&dense.design.unknowns, &dense.null));
    for (component, found) in Component::all().zip(&fit.components) {
        compare_function(&dense, Function::Error(component), found, noise);
    }
    for (component, found) in Component::all().zip(&fit.reversals) {
        compare_function(&dense, Function::Reversal(component), found, noise);
    }
    let single = |parameter, determined, value: Option<f64>, std: Option<f64>| {
        let Some(place) = dense.design.unknowns.index_of(parameter) else {
            assert_eq!(determined, Determined::NotTouched);
            return;
        };
        let open = dense.solution.null.row(place).norm() > 1e-6;
        assert_eq!(determined == Determined::Nothing, open, "{parameter:?}");
        if open {
            return;
        }
        let half = dense.solution.half_covariance.row(place).norm();
        let scale = dense.design.scale[place];
        let (theirs, spread) = (scale * dense.parameters[place], scale * noise * half);
        let reach = theirs.abs().max(spread);
        same(value.unwrap(), theirs, reach, "value");
        same(std.unwrap(), spread, spread, "uncertainty");
    };
    for l in &fit.squareness {
        single(
            Parameter::Squareness(l.location),
            l.determined,
            l.value,
            l.std,
        );
    }
    for m in &fit.mirrors {
        let parameter = Parameter::Mirror(m.diagonal, m.target, m.direction);
        let determined = match m.value {
            Some(_) => Determined::Wholly,
            None => Determined::Nothing,
        };
        single(parameter, determined, m.value, m.std);
    }
    let observed = DVector::from_iterator(readings.len(), readings.iter().map(|r| r.value));
    let reach = observed.amax();
    let mut left = observed - dense.design.dense() * &dense.parameters;
    dense.design.free_of_zero(&mut left);
    for (ours, theirs) in fit.residuals.iter().zip(left.iter()) {
        same(*ours, *theirs, reach, "residual");
    }
}

fn what(steps: usize) -> DiagonalSimulation {
    let mut what = DiagonalSimulation::default();
    what.zone.steps = steps;
    what
}

fn rotations() -> Vec<Component> {
    Component::all().filter(|c| c.rotation).collect()
}

#[test]
fn body_and_face_diagonals_with_either_target() {
    for steps in [1, 2, 3, 4, 7] {
        for diagonals in [&Diagonal::BODY[..], &Diagonal::FACE, &Diagonal::ALL] {
            for targets in [
                &[Target::Mirror][..],
                &[Target::RetroReflector],
                &Target::ALL,
            ] {
                let what = DiagonalSimulation {
                    diagonals: diagonals.to_vec(),
                    targets: targets.to_vec(),
                    ..what(steps)
                };
                let noise = Some(0.2);
                for zero in [Vec::new(), rotations()] {
                    let assumptions = Assumptions {
                        zero,
                        noise,
                        ..Assumptions::default()
                    };
                    compare(&what.zone, &simulate(&what, 3).0, &assumptions);
                }
            }
        }
    }
}

#[test]
fn few_sequences_and_the_way_back() {
    let sets = [
        &[Sequence::XYZ][..],
        &[Sequence::XYZ, Sequence::ZYX],
        &[Sequence::YZX, Sequence::YXZ, Sequence::Together],
        &[Sequence::Together],
    ];
    for steps in [2, 5] {
        for sequences in sets {
            for backward in [false, true] {
                let what = DiagonalSimulation {
                    sequences: sequences.to_vec(),
                    backward,
                    reversal: 1.0,
                    ..what(steps)
                };
                let assumptions = Assumptions {
                    noise: Some(0.2),
                    ..Assumptions::default()
                };
                compare(&what.zone, &simulate(&what, 4).0, &assumptions);
            }
        }
    }
}

/// Repeats of which some lack stops, so that runs over the same stops are of any number.
#[test]
fn repeats_and_readings_that_are_missing() {
    for seed in 0..6 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let what = DiagonalSimulation {
            repeats: 3,
            backward: seed % 2 == 1,
            targets: Target::ALL[..1 + seed as usize % 2].to_vec(),
            ..what(4)
        };
        let (mut readings, ..) = simulate(&what, seed);
        let share = [0.02, 0.5, 0.85][seed as usize % 3];
        readings.retain(|r| r.repeat == 1 && seed < 2 || rng.random_range(0.0..1.0) >= share);
        let assumptions = Assumptions {
            noise: Some(0.2),
            ..Assumptions::default()
        };
        compare(&what.zone, &readings, &assumptions);
    }
}

#[test]
fn measured_slopes_of_any_uncertainty() {
    for std in [1e-9, 1e-3, 1e3] {
        for axes in [&[Axis::X][..], &[Axis::Y, Axis::Z], &Axis::ALL] {
            for zero in [Vec::new(), rotations()] {
                let what = what(4);
                let slopes = axes.iter().map(|&axis| Measured {
                    axis,
                    slope: 0.004,
                    std,
                    degrees_of_freedom: DegreesOfFreedom::Infinite,
                });
                let assumptions = Assumptions {
                    zero,
                    slopes: slopes.collect(),
                    noise: None,
                };
                compare(&what.zone, &simulate(&what, 5).0, &assumptions);
            }
        }
    }
}
