//! What is in a bar turned slowly in a milling spindle beyond a straight line and a once-per-turn
//! sine: the figures of docs/validation/real-data.md. The record is read where it lies:
//! `../shared/data`, or the folder that the environment variable `ERRSEP_DATA` names.

use std::f64::consts::TAU;
use std::path::PathBuf;

use errsep_models::basis::bspline::CubicBSpline;
use nalgebra::{DMatrix, DVector};

/// Turns of the spindle a second, as the file states.
const TURNS: f64 = 2.5625 / 60.0;

/// Time s, place mm and reading µm.
struct Record {
    t: DVector<f64>,
    z: DVector<f64>,
    reading: DVector<f64>,
}

fn record() -> Option<Record> {
    let folder = std::env::var_os("ERRSEP_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let path = folder.join("bridgeport_spindle/testbar_712.csv");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: {} is not there", path.display());
        return None;
    };
    let rows: Vec<[f64; 3]> = text
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
        .map(|l| {
            let mut fields = l.split(',').map(|f| f.trim().parse().unwrap());
            std::array::from_fn(|_| fields.next().unwrap())
        })
        .collect();
    let column = |k: usize, unit: f64| {
        DVector::from_iterator(rows.len(), rows.iter().map(|row| unit * row[k]))
    };
    Some(Record {
        t: column(0, 1.0),
        z: column(1, 1.0),
        reading: column(2, 1e3),
    })
}

impl Record {
    fn wave(&self, turns: f64, shape: fn(f64) -> f64) -> DVector<f64> {
        self.t.map(|t| shape(TAU * turns * TURNS * t))
    }

    /// B-splines along the bar on so many knots, each times a factor.
    fn splines(&self, knots: usize, factor: &DVector<f64>) -> DMatrix<f64> {
        let basis = CubicBSpline::uniform(self.z.min(), self.z.max(), knots - 1).unwrap();
        let mut columns = DMatrix::zeros(self.z.len(), basis.coefficient_count());
        for (i, z) in self.z.iter().enumerate() {
            let (first, values) = basis.values(*z);
            for (j, value) in values.into_iter().enumerate() {
                columns[(i, first + j)] = factor[i] * value;
            }
        }
        columns
    }

    /// Coefficients of a least-squares fit, what it leaves, and its root mean square, µm.
    fn fitted(&self, blocks: &[&DMatrix<f64>]) -> (DVector<f64>, DVector<f64>, f64) {
        let columns: Vec<DVector<f64>> = blocks
            .iter()
            .flat_map(|block| block.column_iter().map(|c| c.clone_owned()))
            .collect();
        let design = DMatrix::from_columns(&columns);
        let normal = design.tr_mul(&design).cholesky().unwrap();
        let solution = normal.solve(&design.tr_mul(&self.reading));
        let left = &self.reading - design * &solution;
        let rms = root_mean_square(&left);
        (solution, left, rms)
    }
}

fn root_mean_square(values: &DVector<f64>) -> f64 {
    values.norm() / (values.len() as f64).sqrt()
}

fn side_by_side(columns: &[DVector<f64>]) -> DMatrix<f64> {
    DMatrix::from_columns(columns)
}

/// Least-squares polynomial, lowest power first.
fn polynomial(x: &DVector<f64>, y: &DVector<f64>, degree: i32) -> DVector<f64> {
    let design = DMatrix::from_fn(x.len(), degree as usize + 1, |i, k| x[i].powi(k as i32));
    let normal = design.tr_mul(&design).cholesky().unwrap();
    normal.solve(&design.tr_mul(y))
}

fn at(coefficients: &DVector<f64>, x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

#[track_caller]
fn told(found: f64, told: f64, within: f64) {
    println!("{found:10.4} told {told}");
    assert!((found - told).abs() <= within, "{found}, told {told}");
}

/// Certified digits: half of the last digit that the page tells.
#[test]
fn what_each_step_leaves() {
    let Some(record) = record() else { return };
    let one = DVector::from_element(record.z.len(), 1.0);
    let line = side_by_side(&[one.clone(), record.z.clone()]);
    let (cos, sin) = (record.wave(1.0, f64::cos), record.wave(1.0, f64::sin));
    let sine = side_by_side(&[cos.clone(), sin.clone()]);
    let growing = side_by_side(&[record.z.component_mul(&cos), record.z.component_mul(&sin)]);
    let slow = record.splines(33, &one);

    told(record.fitted(&[&line]).2, 10.66, 0.005);
    let (found, _, rms) = record.fitted(&[&line, &sine]);
    told(rms, 8.68, 0.005);
    told(found[2].hypot(found[3]), 8.76, 0.005);
    told(record.fitted(&[&line, &sine, &growing]).2, 6.95, 0.005);
    told(record.fitted(&[&slow, &sine, &growing]).2, 4.85, 0.005);
    for (knots, rms) in [(17, 0.58), (33, 0.56)] {
        let free = [record.splines(knots, &cos), record.splines(knots, &sin)];
        told(record.fitted(&[&slow, &free[0], &free[1]]).2, rms, 0.005);
    }
    let n = record.reading.len();
    let second = DVector::from_fn(n - 2, |i, _| {
        record.reading[i] - 2.0 * record.reading[i + 1] + record.reading[i + 2]
    });
    // A second difference has six times the variance of a reading.
    told(root_mean_square(&second) / 6f64.sqrt(), 0.31, 0.005);
}

/// Certified digits, as above.
#[test]
fn turn_eccentricity_and_form() {
    let Some(record) = record() else { return };
    let one = DVector::from_element(record.z.len(), 1.0);
    let slow = record.splines(33, &one);
    let plain = record.splines(17, &one);
    let (cos, sin) = (record.wave(1.0, f64::cos), record.wave(1.0, f64::sin));
    let free = [record.splines(17, &cos), record.splines(17, &sin)];
    let (found, left, _) = record.fitted(&[&slow, &free[0], &free[1]]);
    let (m, n) = (slow.ncols(), plain.ncols());
    let along = &plain * found.rows(m, n);
    let across = &plain * found.rows(m + n, n);

    // A cos wt + B sin wt = R cos(wt + p) with tan p = -B / A.
    let mut phase: Vec<f64> = Vec::with_capacity(along.len());
    for (a, b) in along.iter().zip(&across) {
        let here = (-b).atan2(*a);
        let before = phase.last().copied().unwrap_or(here);
        phase.push(here + TAU * ((before - here) / TAU).round());
    }
    let phase = DVector::from_vec(phase).map(f64::to_degrees);
    let (most, furthest) = phase.argmax();
    told(furthest - phase[0], 524.0, 0.5);
    told(100.0 * record.t[most] / record.t.max(), 64.0, 0.5);
    told(furthest - phase[phase.len() - 1], 47.0, 0.5);
    // Per cent that the spindle turns faster than stated, over 40 s.
    for (part, faster) in [(0.02, 2.4), (0.6, 0.3), (0.8, -0.5), (0.95, 0.0)] {
        let k = (part * phase.len() as f64) as usize;
        let slope = (phase[k + 80] - phase[k - 80]) / (record.t[k + 80] - record.t[k - 80]);
        told(100.0 * slope / (360.0 * TURNS), faster, 0.05);
    }

    let amplitude = along.zip_map(&across, f64::hypot);
    told(amplitude.min(), 5.2, 0.05);
    told(amplitude.max(), 22.2, 0.05);
    // The square of the distance of two straight lines is a parabola.
    let square = polynomial(&record.z, &amplitude.map(|a| a * a), 2);
    let bar = record.z.map(|z| at(&square, z).max(0.0).sqrt());
    told((bar - &amplitude).amax(), 0.3, 0.05);
    told(square[0].sqrt(), 5.5, 0.05);
    told(1e3 * square[2].sqrt(), 87.0, 0.5);
    let between = square[1] / (2.0 * (square[0] * square[2]).sqrt());
    told(between.acos().to_degrees(), 101.0, 0.5);

    let form = &slow * found.rows(0, m);
    let line = polynomial(&record.z, &form, 1);
    let about = form.zip_map(&record.z, |f, z| f - at(&line, z));
    told(1e3 * line[1], 40.7, 0.05);
    told(about.max() - about.min(), 21.6, 0.05);
    let bend = polynomial(&record.z, &form, 2);
    let bent = record.z.map(|z| at(&bend, z) - at(&line, z));
    told(bent.max() - bent.min(), 12.4, 0.05);

    for (turns, size) in [(2.0, 0.13), (3.0, 0.07)] {
        let waves = side_by_side(&[record.wave(turns, f64::cos), record.wave(turns, f64::sin)]);
        let normal = waves.tr_mul(&waves).cholesky().unwrap();
        told(normal.solve(&waves.tr_mul(&left)).norm(), size, 0.005);
    }
    for (lag, correlation) in [(1, 0.67), (40, 0.0)] {
        let k = left.len() - lag;
        let product = left.rows(0, k).dot(&left.rows(lag, k));
        told(product / left.norm_squared(), correlation, 0.005);
    }
}
