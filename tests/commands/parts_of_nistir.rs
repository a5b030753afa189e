//! How far the parts of NISTIR 6868 scatter beyond what its machine predicts: the figures of
//! docs/validation/real-data.md that stand beside the command's.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use errsep::io::machine::read_machine;
use errsep::io::parts::read_parts;
use errsep_models::machine::{Axis, part_residuals};
use nalgebra::{DMatrix, DVector};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/nistir6868")
        .join(name)
}

#[track_caller]
fn told(found: f64, told: f64, within: f64) {
    println!("{found:10.4} told {told}");
    assert!((found - told).abs() <= within, "{found}, told {told}");
}

/// x and y in mm, and whether the direction measured is y.
type Point = (f64, f64, bool);

/// How a point moves with its part.
type Motion = fn(&Point) -> f64;

/// Mean residual of each point of each part with what was predicted for it, µm.
struct Process {
    parts: usize,
    points: Vec<Point>,
    /// Parts × points.
    residuals: DMatrix<f64>,
    predicted: DVector<f64>,
}

impl Process {
    fn of(file: &str) -> Self {
        let machine = read_machine(&fixture("machine.toml"), None).unwrap();
        let points = fixture("holes.csv");
        let readings = read_parts(&[fixture(file)], &Default::default(), Some(&points)).unwrap();
        let residuals = part_residuals(&machine, &readings).unwrap();
        let mut cells: BTreeMap<(&str, &str, bool), Vec<f64>> = BTreeMap::new();
        let mut places = BTreeMap::new();
        for r in &residuals {
            let y = r.reading.axis == Axis::Y;
            let (part, feature) = (r.reading.part.as_str(), r.reading.feature.as_str());
            cells
                .entry((part, feature, y))
                .or_default()
                .push(r.residual);
            let at = (r.reading.position.x, r.reading.position.y, y);
            places.insert((feature, y), (at, r.standard_uncertainty));
        }
        let parts: Vec<&str> = {
            let mut names: Vec<&str> = cells.keys().map(|k| k.0).collect();
            names.dedup();
            names
        };
        let keys: Vec<(&str, bool)> = places.keys().copied().collect();
        let mean = |i: usize, j: usize| {
            let values = &cells[&(parts[i], keys[j].0, keys[j].1)];
            values.iter().sum::<f64>() / values.len() as f64
        };
        Self {
            parts: parts.len(),
            points: places.values().map(|(at, _)| *at).collect(),
            residuals: DMatrix::from_fn(parts.len(), keys.len(), mean),
            predicted: DVector::from_iterator(keys.len(), places.values().map(|p| p.1)),
        }
    }

    /// Standard deviation between parts once `own` functions of the points are fitted to each part,
    /// by the degrees of freedom left, over the predicted standard uncertainty.
    fn beyond(&self, own: &[Motion]) -> (f64, f64) {
        let n = self.points.len();
        let mut centred = self.residuals.clone();
        for mut column in centred.column_iter_mut() {
            let mean = column.mean();
            column.add_scalar_mut(-mean);
        }
        let mut freedom = n;
        if !own.is_empty() {
            let design = DMatrix::from_fn(n, own.len(), |j, k| own[k](&self.points[j]));
            let projection = &design * design.clone().pseudo_inverse(1e-9).unwrap();
            centred -= centred.clone() * projection;
            freedom -= own.len();
        }
        let square = centred.norm_squared() / ((self.parts - 1) * freedom) as f64;
        let predicted = self.predicted.norm() / (n as f64).sqrt();
        (square.sqrt(), square.sqrt() / predicted)
    }
}

const ZERO: [Motion; 2] = [|p| f64::from(u8::from(!p.2)), |p| f64::from(u8::from(p.2))];
const ZERO_AND_ANGLE: [Motion; 3] = [ZERO[0], ZERO[1], |p| if p.2 { p.0 } else { -p.1 }];

/// Certified digits: half of the last digit that the page tells.
#[test]
fn what_is_left_between_parts_is_what_was_predicted() {
    let drilled = Process::of("drilled_holes.csv");
    let milled = Process::of("milled_holes.csv");
    let predicted = drilled.predicted.norm() / 6f64.sqrt();
    told(predicted, 4.6, 0.05);
    told(drilled.beyond(&[]).1, 4.4, 0.05);
    told(milled.beyond(&[]).1, 2.0, 0.05);
    for (process, own, left, over) in [
        (&drilled, &ZERO[..], 5.9, 1.3),
        (&milled, &ZERO, 4.4, 1.0),
        (&drilled, &ZERO_AND_ANGLE, 5.1, 1.1),
        (&milled, &ZERO_AND_ANGLE, 4.4, 1.0),
    ] {
        let found = process.beyond(own);
        told(found.0, left, 0.05);
        told(found.1, over, 0.05);
    }
}

fn table(name: &str, column: &str) -> Vec<f64> {
    let mut reader = csv::Reader::from_path(fixture(name)).unwrap();
    let at = reader.headers().unwrap().iter().position(|h| h == column);
    let at = at.unwrap();
    reader
        .records()
        .map(|r| r.unwrap()[at].parse().unwrap())
        .collect()
}

/// The report's own figures over the predicted ones, 24 holes. Certified digits, as above.
#[test]
fn the_nine_and_four_of_the_report() {
    let predicted = ["var_Ex_um2", "var_Ey_um2"].map(|c| table("tableA1_holes.csv", c));
    let square = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
    let future = [
        (
            "tableB5_drilled_x.csv",
            "u_future_um",
            "tableB6_corrected.csv",
        ),
        (
            "tableB7_milled_x.csv",
            "u_future_um",
            "tableB8_corrected.csv",
        ),
    ]
    .map(|(x, column, y)| [table(x, column), table(y, "u_future_corrected_um")]);
    for (process, over, mean_x, most_x) in
        [(&future[0], 7.4, 8.1, 14.0), (&future[1], 2.8, 3.8, 5.3)]
    {
        let expected: f64 = predicted.iter().flatten().sum();
        told(
            ((square(&process[0]) + square(&process[1])) / expected).sqrt(),
            over,
            0.05,
        );
        let ratios: Vec<f64> = process[0]
            .iter()
            .zip(&predicted[0])
            .map(|(u, v)| u / v.sqrt())
            .collect();
        told(
            ratios.iter().sum::<f64>() / ratios.len() as f64,
            mean_x,
            0.05,
        );
        told(ratios.iter().copied().fold(0.0, f64::max), most_x, 0.05);
    }
}
