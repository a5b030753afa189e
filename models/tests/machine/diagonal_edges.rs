//! Whole diagonals and the edges of a cuboid, equations (5), (6), (23) and (29) to (34), against a
//! machine with known errors by exact geometry; what the seven new readings of a cuboid hold.

use crate::diagonal_truth::{Truth, ZONE, by_exact_geometry, errors};
use errsep_models::diagonal::{
    Component, Diagonal, DiagonalReading, Edges, Location, Motion, Sequence, Target, Travel,
    WorkZone, closed_forms, predicted_reading, totals,
};
use nalgebra::{DMatrix, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Truncation: the third order of 50 µrad at 600 mm is 1e-7 µm.
const THIRD_ORDER: f64 = 1e-6;

/// dd_PQ of a cell.
fn dd(
    readings: &[DiagonalReading],
    edges: &Edges,
    diagonal: Diagonal,
    cell: [usize; 3],
    corners: &str,
) -> f64 {
    let mut letters = corners.chars();
    let (from, to) = (letters.next().unwrap(), letters.next().unwrap());
    let weights = edges
        .weights(diagonal, Target::Mirror, cell, (from, to), Motion::Either)
        .unwrap();
    weights.iter().map(|&(r, w)| w * readings[r].value).sum()
}

#[test]
fn differences_of_parallel_edges_follow_29_to_34() {
    for seed in 0..4 {
        let tables = errors(seed);
        // Any misalignment of the mirror: parallel edges see it alike.
        let readings = by_exact_geometry(&tables, Target::Mirror, [0.0; 2], 60e-6);
        let edges = Edges::of(&readings);
        let truth = Truth {
            tables: &tables,
            em: [0.0; 2],
        };
        let n = Diagonal::AG.direction(&ZONE);
        let [dx, dy, _] = ZONE.step().map(|step| 1e3 * step);
        for i in 0..ZONE.steps {
            let k = ZONE.steps - 1 - i;
            let step = |name: &str| truth.step(name, i);
            let difference = |diagonal, cell, upper, lower| {
                dd(&readings, &edges, diagonal, cell, upper)
                    - dd(&readings, &edges, diagonal, cell, lower)
            };
            let (iii, iik, kki) = ([i, i, i], [i, i, k], [k, k, i]);
            use Diagonal::{AG, CE};
            for (equation, found, right) in [
                (
                    "(29)",
                    difference(AG, iii, "DC", "AB"),
                    dx * (n.z * step("EBY") - n.y * step("ECY")),
                ),
                (
                    "(30)",
                    difference(AG, iii, "EF", "AB"),
                    dx * (n.z * step("EBZ") - n.y * step("ECZ")),
                ),
                (
                    "(31)",
                    difference(AG, iii, "EH", "AD"),
                    dy * (-n.z * step("EAZ") + n.x * step("ECZ")),
                ),
                (
                    "(32)",
                    difference(CE, iik, "DC", "AB"),
                    dx * (n.z * step("EBY") + n.y * step("ECY")),
                ),
                (
                    "(33)",
                    difference(CE, kki, "EF", "AB"),
                    dx * (n.z * step("EBZ") + n.y * step("ECZ")),
                ),
                (
                    "(34)",
                    difference(CE, kki, "EH", "AD"),
                    dy * (-n.z * step("EAZ") - n.x * step("ECZ")),
                ),
            ] {
                assert!(
                    (found - right).abs() < THIRD_ORDER,
                    "{equation} at {i}, seed {seed}: {found} {right}"
                );
            }
        }
    }
}

#[test]
fn whole_body_diagonals_follow_5_and_6() {
    for seed in 0..4 {
        let tables = errors(seed);
        let readings = by_exact_geometry(&tables, Target::Mirror, [0.0; 2], 60e-6);
        let truth = Truth {
            tables: &tables,
            em: [0.0; 2],
        };
        let n = Diagonal::AG.direction(&ZONE);
        let [_, dy, dz] = ZONE.travel.map(|t| 1e3 * t);
        let change = |name: &str| truth.e(name, ZONE.steps) - truth.e(name, 0);
        // (5) to (10) count angular errors, and with them the squareness angles, from corner A. The roll of
        // X there turns Y and Z together and changes no squareness.
        let at_a = |name: &str| truth.e(name, 0);
        let xy = tables.squareness_of(Location::XY) + at_a("ECX");
        let xz = tables.squareness_of(Location::XZ) - at_a("EBX") - at_a("EBY");
        let yz = tables.squareness_of(Location::YZ) + at_a("EAY");
        let ag = n.x
            * (change("EXX")
                + change("EXY")
                + change("EXZ")
                + (change("EBX") + change("EBY") - xz) * dz
                - (change("ECX") + xy) * dy)
            + n.y * (change("EYX") + change("EYY") + change("EYZ") - (change("EAY") + yz) * dz)
            + n.z * (change("EZX") + change("EZY") + change("EZZ"));
        // Corrected: the sign before n_y is +; y runs backwards, so DF begins at y = ΔY.
        let df = n.x
            * (change("EXX") - change("EXY") + change("EXZ") + (change("EBX") - xz) * dz + xy * dy)
            + n.y * (-change("EYX") + change("EYY") - change("EYZ") + (change("EAX") + yz) * dz)
            + n.z * (change("EZX") - change("EZY") + change("EZZ"));
        let found = totals(&ZONE, &readings).unwrap().errors;
        for (equation, diagonal, right) in [("(5)", Diagonal::AG, ag), ("(6)", Diagonal::DF, df)] {
            let value = found[&diagonal].0;
            assert!(
                (value - right).abs() < THIRD_ORDER,
                "{equation}, seed {seed}: {value} {right}"
            );
        }
    }
}

#[test]
fn spread_of_a_positioning_error_reaches_the_straightness_as_23() {
    // Positioning of X that does not repeat: every run has its own. (21) then scatters by
    // s² = 2 nx²/(4 ny²) s²(ΔEXX), whatever the step.
    let zone = WorkZone {
        travel: [600.0, 450.0, 300.0],
        steps: 3,
    };
    let n = Diagonal::AC.direction(&zone);
    let mut generator = ChaCha8Rng::seed_from_u64(23);
    let positioning = Component::from_name("EXX").unwrap();
    let trials = 4000;
    let mut squares = vec![0.0; zone.steps];
    for _ in 0..trials {
        let mut readings = Vec::new();
        for (diagonal, sequence) in [(Diagonal::AC, Sequence::XYZ), (Diagonal::DB, Sequence::YXZ)] {
            let mut tables = errsep_models::diagonal::ErrorTables::zero(&zone);
            let mut sum = 0.0;
            for value in tables.of_mut(positioning) {
                *value = sum;
                let step: f64 = StandardNormal.sample(&mut generator);
                sum += step;
            }
            let mut stops = zone.stops(diagonal, sequence);
            stops.dedup();
            readings.extend(stops.into_iter().map(|at| DiagonalReading {
                diagonal,
                target: Target::Mirror,
                sequence,
                repeat: 1,
                travel: Travel::Forward,
                at,
                value: predicted_reading(
                    &zone,
                    &tables,
                    diagonal,
                    Target::Mirror,
                    Vector3::zeros(),
                    at,
                    Travel::Forward,
                ),
            }));
        }
        let forms = closed_forms(&zone, &readings).unwrap();
        let form = forms.iter().find(|f| f.equation == "(21)").unwrap();
        for (square, value) in squares.iter_mut().zip(&form.steps) {
            *square += value * value / f64::from(trials);
        }
        // Its first form: readings of unit variance make s²(dd) = 2.
        for gain in &form.step_gains {
            let right = 2.0 / (4.0 * n.y * n.y) * 2.0;
            assert!((gain * gain / right - 1.0).abs() < 1e-12, "{gain}");
        }
    }
    let right = 2.0 * n.x * n.x / (4.0 * n.y * n.y);
    for square in squares {
        // Tolerance: k·u, a mean square of 4000 normal values is known to √(2/4000) = 2.2 %; 4 of them.
        assert!((square / right - 1.0).abs() < 0.09, "{square} {right}");
    }
}

/// The twelve edges of a cuboid, lower corner first.
const EDGES: [&str; 12] = [
    "AB", "DC", "EF", "HG", "AD", "BC", "EH", "FG", "AE", "BF", "CG", "DH",
];

#[test]
fn a_cuboid_has_seven_new_readings_and_five_constraints_on_its_twelve_edges() {
    let zone = WorkZone { steps: 1, ..ZONE };
    for diagonal in Diagonal::BODY {
        let mut readings = Vec::new();
        for sequence in Sequence::STEPS {
            readings.extend(
                zone.stops(diagonal, sequence)
                    .into_iter()
                    .map(|at| DiagonalReading {
                        diagonal,
                        target: Target::Mirror,
                        sequence,
                        repeat: 1,
                        travel: Travel::Forward,
                        at,
                        value: 0.0,
                    }),
            );
        }
        let start = zone.stops(diagonal, Sequence::Together)[0];
        let mut corners: Vec<[usize; 3]> = readings.iter().map(|r| r.at).collect();
        corners.sort_unstable();
        corners.dedup();
        corners.retain(|at| *at != start);
        assert_eq!(corners.len(), 7, "new readings");
        let edges = Edges::of(&readings);
        let mut rows = DMatrix::<f64>::zeros(EDGES.len(), corners.len());
        for (row, letters) in EDGES.iter().enumerate() {
            let mut letters = letters.chars();
            let (from, to) = (letters.next().unwrap(), letters.next().unwrap());
            let weights =
                edges.weights(diagonal, Target::Mirror, [0; 3], (from, to), Motion::Either);
            for (reading, weight) in weights.unwrap() {
                if let Ok(place) = corners.binary_search(&readings[reading].at) {
                    rows[(row, place)] += weight;
                }
            }
        }
        // Tolerance: epsilons of a matrix of −1, 0 and 1.
        let rank = rows.rank(1e-12);
        assert_eq!(EDGES.len() - rank, 5, "constraints on the edges");
        // One edge of each axis and four independent differences of parallel edges; the two of a face
        // are equal.
        let mut differences = DMatrix::<f64>::zeros(9, corners.len());
        for axis in 0..3 {
            for other in 1..4 {
                let difference = rows.row(4 * axis + other) - rows.row(4 * axis);
                differences.set_row(3 * axis + other - 1, &difference);
            }
        }
        assert_eq!(differences.rank(1e-12), 4, "differences of parallel edges");
        let edge = |name: &str| rows.row(EDGES.iter().position(|e| *e == name).unwrap());
        for [a, b, c, d] in [
            ["DC", "AB", "BC", "AD"],
            ["HG", "EF", "FG", "EH"],
            ["EF", "AB", "BF", "AE"],
            ["HG", "DC", "CG", "DH"],
            ["EH", "AD", "DH", "AE"],
            ["FG", "BC", "CG", "BF"],
        ] {
            let closure = (edge(a) - edge(b)) - (edge(c) - edge(d));
            assert!(closure.norm() < 1e-12, "{a} − {b} = {c} − {d}");
        }
    }
}
