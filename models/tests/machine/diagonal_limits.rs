//! What the paper says the test cannot see, and what it gives anyway.

use errsep_models::diagonal::{
    Component, Diagonal, DiagonalReading, ErrorTables, Location, Sequence, Target, Travel,
    WorkZone, closed_forms, identifiability, predicted_reading,
};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn zone(steps: usize) -> WorkZone {
    WorkZone {
        travel: [600.0, 480.0, 360.0],
        steps,
    }
}

/// Readings in the plane, both sequences on both diagonals; `mirror` about Z on AC and DB, rad.
fn plane(
    zone: &WorkZone,
    tables: &ErrorTables,
    target: Target,
    mirror: [f64; 2],
) -> Vec<DiagonalReading> {
    let mut readings = Vec::new();
    for (diagonal, em) in Diagonal::FACE.into_iter().zip(mirror) {
        for sequence in [Sequence::XYZ, Sequence::YXZ] {
            let mut stops = zone.stops(diagonal, sequence);
            stops.dedup();
            let misaligned = Vector3::new(0.0, 0.0, em);
            readings.extend(stops.into_iter().map(|at| DiagonalReading {
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
            }));
        }
    }
    readings
}

fn with(zone: &WorkZone, name: &str, value: impl Fn(f64) -> f64) -> ErrorTables {
    let mut tables = ErrorTables::zero(zone);
    let component = Component::from_name(name).unwrap();
    for (i, v) in tables.of_mut(component).iter_mut().enumerate() {
        *v = value(i as f64 / zone.steps as f64);
    }
    tables
}

fn profile(zone: &WorkZone, readings: &[DiagonalReading], equation: &str) -> Vec<f64> {
    let forms = closed_forms(zone, readings).unwrap();
    let form = forms.into_iter().find(|f| f.equation == equation);
    form.unwrap().profile
}

fn values(readings: &[DiagonalReading]) -> DVector<f64> {
    DVector::from_iterator(readings.len(), readings.iter().map(|r| r.value))
}

#[test]
fn mirror_misalignment_reads_as_slopes_and_squareness() {
    // The mirror's readings lie in the span of the slopes of the four translations and Sxy, so no
    // analysis can detect a constant misalignment.
    let zone = zone(6);
    for target in [Target::Mirror, Target::RetroReflector] {
        let mut columns: Vec<DVector<f64>> = ["EXX", "EYX", "EXY", "EYY"]
            .iter()
            .map(|name| values(&plane(&zone, &with(&zone, name, |t| t), target, [0.0; 2])))
            .collect();
        let mut square = ErrorTables::zero(&zone);
        square.squareness[Location::XY as usize] = 1e-5;
        columns.push(values(&plane(&zone, &square, target, [0.0; 2])));
        let span = DMatrix::from_columns(&columns).svd(true, true);
        for mirror in [[1e-5, 0.0], [0.0, 1e-5], [7e-5, -2e-5]] {
            let seen = values(&plane(&zone, &ErrorTables::zero(&zone), target, mirror));
            let coefficients = span.solve(&seen, 1e-12).unwrap();
            let left = DMatrix::from_columns(&columns) * coefficients - &seen;
            // Tolerance: 1e4 epsilons of 30 µm.
            assert!(seen.norm() > 1.0 && left.norm() < 1e-10, "{}", left.norm());
        }
    }
}

#[test]
fn each_new_point_of_a_plane_brings_five_combinations() {
    for target in [Target::Mirror, Target::RetroReflector] {
        let mut runs = Vec::new();
        for diagonal in Diagonal::FACE {
            runs.push((diagonal, target, Sequence::XYZ));
            runs.push((diagonal, target, Sequence::YXZ));
        }
        for steps in 1..9 {
            let found = identifiability(&zone(steps), &runs).unwrap();
            assert_eq!(found.rank, 5 * steps, "{target:?} {steps}");
        }
    }
}

#[test]
fn yaw_of_y_changes_no_total_of_the_positioning_of_x() {
    // After (19): a constant yaw has no effect on any step, and no yaw has one over the whole travel.
    let zone = zone(7);
    let constant = plane(
        &zone,
        &with(&zone, "ECY", |_| 3e-5),
        Target::Mirror,
        [0.0; 2],
    );
    for value in profile(&zone, &constant, "(19)") {
        // Tolerance: 1e4 epsilons of 30 µm.
        assert!(value.abs() < 1e-10, "{value}");
    }
    let mut generator = ChaCha8Rng::seed_from_u64(19);
    let mut tables = ErrorTables::zero(&zone);
    for v in tables.of_mut(Component::from_name("ECY").unwrap()) {
        *v = 3e-5 * generator.random_range(-1.0..1.0);
    }
    let any = profile(
        &zone,
        &plane(&zone, &tables, Target::Mirror, [0.0; 2]),
        "(19)",
    );
    let greatest = any.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(greatest > 0.5, "{any:?}");
    assert!(any[zone.steps].abs() < 1e-10, "{any:?}");
}

#[test]
fn the_integrated_yaw_alone_is_an_eighth() {
    // 1 µrad/m over 1 m: −Δx Σ ECX is a parabola of 1/8 µm; the variable offset of (21) adds as much.
    let zone = WorkZone {
        travel: [1000.0, 1000.0, 1.0],
        steps: 200,
    };
    let tables = with(&zone, "ECX", |t| 1e-6 * t);
    let yaw = tables.of(Component::from_name("ECX").unwrap());
    let [dx, ..] = zone.step();
    let mut integral = vec![0.0];
    let mut offset = vec![0.0];
    for i in 0..zone.steps {
        let k = zone.steps - 1 - i;
        let variable = 0.5e3 * dx * (k as f64 - (i + 1) as f64) * (yaw[i + 1] - yaw[i]);
        integral.push(integral[i] - 1e3 * dx * yaw[i]);
        offset.push(offset[i] + variable);
    }
    let sag = |p: &[f64]| p[100] - 0.5 * (p[0] + p[200]);
    // Tolerance: truncation, one step in 200.
    assert!((sag(&integral).abs() - 0.125).abs() < 0.002);
    assert!((sag(&offset).abs() - 0.125).abs() < 0.002);
    let both = profile(
        &zone,
        &plane(&zone, &tables, Target::Mirror, [0.0; 2]),
        "(21)",
    );
    for ((found, a), b) in both.iter().zip(&integral).zip(&offset) {
        // Tolerance: 1e4 epsilons of 1 µm.
        assert!((found - a - b).abs() < 1e-11, "{found} {a} {b}");
    }
}

#[test]
fn removing_the_slope_of_a_straightness_removes_the_mirror() {
    let zone = zone(6);
    let readings = plane(
        &zone,
        &ErrorTables::zero(&zone),
        Target::Mirror,
        [6e-5, -1e-5],
    );
    for equation in ["(21)", "(22)"] {
        let found = profile(&zone, &readings, equation);
        let slope = found[zone.steps] / zone.steps as f64;
        assert!(slope.abs() > 1.0, "{found:?}");
        for (i, value) in found.iter().enumerate() {
            // Tolerance: 1e4 epsilons of 30 µm.
            assert!(
                (value - slope * i as f64).abs() < 1e-10,
                "{equation} {found:?}"
            );
        }
    }
}

#[test]
fn small_diagonal_errors_do_not_make_a_good_machine() {
    // Slopes of X and Y in the ratio −ny : nx cancel at every point of both face diagonals.
    let zone = zone(6);
    let n = Diagonal::AC.direction(&zone);
    let mut tables = with(&zone, "EXX", |t| -20.0 * n.y * t);
    let y = with(&zone, "EYY", |t| 20.0 * n.x * t);
    let yy = Component::from_name("EYY").unwrap();
    tables.of_mut(yy).clone_from(&y.of(yy).to_vec());
    for diagonal in Diagonal::FACE {
        for at in zone.stops(diagonal, Sequence::Together) {
            let read = predicted_reading(
                &zone,
                &tables,
                diagonal,
                Target::Mirror,
                Vector3::zeros(),
                at,
                Travel::Forward,
            );
            // Tolerance: 1e4 epsilons of 20 µm.
            assert!(read.abs() < 1e-11, "{diagonal:?} {at:?} {read}");
        }
    }
    // Single-axis steps do see them.
    let steps = plane(&zone, &tables, Target::Mirror, [0.0; 2]);
    assert!((profile(&zone, &steps, "(19)")[6] + 20.0 * n.y).abs() < 1e-10);
    assert!((profile(&zone, &steps, "(20)")[6] - 20.0 * n.x).abs() < 1e-10);
}
