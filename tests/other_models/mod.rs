//! Makers of data for every model but the reversal: known effects in exact form, noise, repeats.
#![allow(dead_code, reason = "the campaign and the tests each use their part")]

use std::sync::OnceLock;

use errsep::diagnosis::{Diagnosis, Hidden, Kind, Options, diagnose};
use errsep_models::calibration_line::CalibrationLine;
use errsep_models::calibration_line::simulate as line;
use errsep_models::circle::{self, CirclePoints, CircleSimulation};
use errsep_models::diagonal::{self, Component, DiagonalRuns, DiagonalSimulation, Sequence};
use errsep_models::four_sensor::simulate::{Disturbances, Example, simulate};
use errsep_models::four_sensor::{FourSensors, Geometry};
use errsep_models::fourier::{self, FourierScans, FourierSimulation, Section};
use errsep_models::machine::{
    Chain, ComponentError, ErrorFunction, Machine, MeasuredParts, PartDisturbance, Position, Sense,
    Spread, simulate_parts_disturbed,
};
use errsep_models::model::{AnyModel, FittedModel};

/// Effects by their names and sizes.
pub type Put<'a> = &'a [(&'a str, f64)];

/// A model with its effects and a way to diagnose one measurement of it.
pub struct Maker {
    /// Name of the model.
    pub model: &'static str,
    /// Effects that such data show.
    pub effects: &'static [&'static str],
    /// Makes the data of a seed, with an effect or none.
    pub made: fn(Put<'_>, u64) -> AnyModel,
    /// Standard deviation of the noise of a reading.
    pub noise: f64,
}

impl Maker {
    /// Makes the data of a seed, with an effect or none, and diagnoses them.
    pub fn diagnosed(&self, put: Put<'_>, seed: u64, options: &Options) -> Diagnosis {
        diagnose(&(self.made)(put, seed), options)
    }
}

/// All models but the reversal.
pub const MAKERS: [Maker; 6] = [
    Maker {
        model: "calibration-line",
        effects: &[
            "cubic",
            "drift",
            "logarithmic",
            "quadratic",
            "saturation",
            "sensitivity-drift",
            "set-offset",
            "set-slope",
            "square-root",
            "zero-jump",
        ],
        made: |put, seed| AnyModel::new(&calibration_line_made(put, seed, 1.0)),
        noise: 1e-3,
    },
    Maker {
        model: "circle",
        effects: &[
            "asynchronous-motion",
            "axis-backlash",
            "centre-drift",
            "lobes",
            "outlier",
            "ovality",
            "part-moved",
            "radius-growth",
            "scale-mismatch",
            "squareness",
            "zero-jump",
        ],
        made: |put, seed| AnyModel::new(&circle_made(put, seed, 1.0)),
        noise: 1.0,
    },
    Maker {
        model: "four-sensor",
        effects: &[
            "drift",
            "gain",
            "lag",
            "nonlinearity",
            "sensor-position",
            "settling",
            "zero-jump",
        ],
        made: |put, seed| AnyModel::new(&four_sensor_made(put, seed, 1.0)),
        noise: 0.1,
    },
    Maker {
        model: "fourier",
        effects: &[
            "drift",
            "gain",
            "height-difference",
            "nonlinearity",
            "probe-spacing",
            "thermal-bending",
            "travel-scale",
            "yaw",
            "zero-jump",
        ],
        made: |put, seed| AnyModel::new(&fourier_made(put, seed, 1.0)),
        noise: 1.0,
    },
    Maker {
        model: "step-diagonal",
        effects: &[
            "angular-error",
            "axis-growth",
            "drift",
            "lost-counts",
            "mirror-creep",
            "mirror-misalignment",
            "thermal-expansion",
        ],
        made: |put, seed| AnyModel::new(&step_diagonal_made(put, seed, 1.0)),
        noise: 0.2,
    },
    Maker {
        model: "machine",
        effects: &[
            "angular-error-times-height",
            "axis-scale",
            "bad-part",
            "datum-offset",
            "datum-rotation",
            "part-rotation",
            "part-temperature",
            "part-zero",
            "squareness-change",
            "thermal-expansion",
        ],
        made: |put, seed| AnyModel::new(&machine_made(put, seed, 1.0)),
        noise: 0.5,
    },
];

const REPEATS: u32 = 4;

/// A calibration of four sets, its noise a number of times the usual.
pub fn calibration_line_made(put: Put<'_>, seed: u64, noise: f64) -> CalibrationLine {
    let what = line::CalibrationSimulation {
        line: [0.5, 2e-3],
        full_scale: 1000.0,
        loads: 20,
        sets: REPEATS,
        both_directions: false,
        noise: 1e-3 * noise,
        disturbances: put
            .iter()
            .filter_map(|(name, size)| line::Disturbance::named(name, *size, REPEATS))
            .collect(),
    };
    let readings = line::simulate(&what, seed).unwrap();
    CalibrationLine::new(&readings, None).unwrap()
}

/// Four passes over a circle, likewise.
pub fn circle_made(put: Put<'_>, seed: u64, noise: f64) -> CirclePoints {
    let mut what = CircleSimulation {
        count: 72,
        noise_um: noise,
        ..CircleSimulation::default()
    };
    let mut points = Vec::new();
    for repeat in 1..=REPEATS {
        what.pass = (repeat as usize - 1, REPEATS as usize);
        // Dirt lies in one pass only.
        let disturbances: Vec<circle::Disturbance> = put
            .iter()
            .filter(|(name, _)| repeat == 1 || *name != "outlier")
            .filter_map(|(name, size)| circle::Disturbance::named(name, *size, what.count))
            .collect();
        let pass_seed = seed * 100 + u64::from(repeat);
        let pass = circle::simulate_disturbed(&what, &disturbances, pass_seed).unwrap();
        points.extend(pass.into_iter().map(|p| (p, repeat)));
    }
    CirclePoints::new(&points, None).unwrap()
}

/// Four runs of four sensors, likewise.
pub fn four_sensor_made(put: Put<'_>, seed: u64, noise: f64) -> FourSensors {
    let geometry = Geometry::new(5.0, [1, 1, 5], 62).unwrap();
    let truth = Example::of(&geometry);
    let mut disturbances = Disturbances::noise(0.1 * noise);
    for (name, size) in put {
        assert!(disturbances.add(name, *size), "{name}");
    }
    let repeats: Vec<_> = (0..u64::from(REPEATS))
        .map(|repeat| {
            disturbances.pass = (repeat as usize, REPEATS as usize);
            simulate(&geometry, &truth, &disturbances, seed * 100 + repeat).unwrap()
        })
        .collect();
    FourSensors::new(&repeats, None).unwrap()
}

/// Four scans of each spacing, likewise.
pub fn fourier_made(put: Put<'_>, seed: u64, noise: f64) -> FourierScans {
    let what = FourierSimulation {
        samples: 100,
        orders: 20,
        repeats: REPEATS,
        noise,
        ..FourierSimulation::default()
    };
    let disturbances: Vec<_> = put
        .iter()
        .filter_map(|(name, size)| fourier::Disturbance::named(name, *size, what.spacings.len()))
        .collect();
    let (scans, _) = fourier::simulate_disturbed(&what, &disturbances, seed).unwrap();
    let section = Section {
        length: what.length,
        orders: what.orders,
    };
    FourierScans::new(&scans, section, None).unwrap()
}

/// Four runs of each sequence, likewise.
pub fn step_diagonal_made(put: Put<'_>, seed: u64, noise: f64) -> DiagonalRuns {
    let usual = DiagonalSimulation::default();
    let what = DiagonalSimulation {
        noise: noise * usual.noise,
        sequences: vec![Sequence::XYZ, Sequence::YZX, Sequence::ZXY],
        repeats: REPEATS,
        rotation: 0.0,
        ..usual
    };
    let disturbances: Vec<_> = put
        .iter()
        .filter_map(|(name, size)| diagonal::Disturbance::named(name, *size, &what))
        .collect();
    let (readings, _, _) = diagonal::simulate_disturbed(&what, &disturbances, seed);
    let rotations: Vec<Component> = Component::all().filter(|c| c.rotation).collect();
    DiagonalRuns::new(&what.zone, &readings, &rotations, None).unwrap()
}

/// A machine without scatter: what differs between parts is what was put in. Its noise is a number of
/// times the usual.
pub fn machine_made(put: Put<'_>, seed: u64, noise: f64) -> MeasuredParts {
    let error = |name: &str, coefficients: Vec<f64>| ComponentError {
        component: name.parse().unwrap(),
        function: ErrorFunction::polynomial(coefficients),
        spread: Spread::none(),
    };
    let errors = vec![
        error("EXX", vec![0.5, -0.02]),
        error("EYY", vec![0.0, 0.01]),
    ];
    let machine = Machine::new(Chain::parse("FXYZ").unwrap(), Sense::Tool, errors).unwrap();
    let points: Vec<(String, Position)> = [0.0, 60.0]
        .into_iter()
        .flat_map(|z| {
            [(10.0, 10.0), (140.0, 10.0), (150.0, 120.0), (20.0, 130.0)]
                .map(|(x, y)| Position::new(x, y, z))
        })
        .enumerate()
        .map(|(k, p)| (format!("{}", k + 1), p))
        .collect();
    let disturbances: Vec<_> = put
        .iter()
        .filter_map(|(name, size)| PartDisturbance::named(name, *size))
        .collect();
    let readings = simulate_parts_disturbed(
        &machine,
        &points,
        6,
        REPEATS,
        0.5 * noise,
        &disturbances,
        seed,
    )
    .unwrap();
    MeasuredParts::new(&machine, readings).unwrap()
}

/// Whether the size that was found is within two standard uncertainties of the true one, and of the
/// sensor that was disturbed; none where the diagnosis leaves another variant open, and for parts
/// whose own zeros, turns and scales were drawn with that size as their standard deviation.
pub fn within(diagnosis: &Diagnosis, effect: &str, size: f64) -> Option<bool> {
    if ["part-zero", "part-rotation", "part-temperature"].contains(&effect) {
        return None;
    }
    let size = size * told_of_put(diagnosis.model, effect);
    let candidate = diagnosis.candidates.iter().find(|c| c.effect == effect)?;
    if !candidate.elsewhere.is_empty() {
        return None;
    }
    let sensor = candidate.variant.as_deref();
    let is_one = |v: &str| v.starts_with("sensor") || v.starts_with("probe");
    let right = sensor.is_none_or(|v| !is_one(v) || v == "sensor 3" || v == "probe 2");
    let found = candidate.parameters.first()?;
    Some(right && (found.value.abs() - size).abs() <= 2.0 * found.std)
}

/// What the size of an effect is told to be, per unit of what is put in: a yaw is put in by the amplitude of a wave and
/// told by its root mean square, the bend of a sensor's characteristic (four sensors) at 30 µm and told at its greatest reading.
pub fn told_of_put(model: &str, effect: &str) -> f64 {
    match (model, effect) {
        (_, "yaw") => 0.5f64.sqrt(),
        ("four-sensor", "nonlinearity") => (greatest_of_sensor_3() / 30.0).powi(2),
        _ => 1.0,
    }
}

/// The greatest reading of the sensor that is disturbed, µm.
fn greatest_of_sensor_3() -> f64 {
    static GREATEST: OnceLock<f64> = OnceLock::new();
    *GREATEST.get_or_init(|| {
        let quiet = four_sensor_made(&[], 1, 0.0);
        let readings = quiet.linearised();
        let own = quiet.places().iter().zip(readings.iter());
        own.filter(|(place, _)| place.channel == 2)
            .fold(0.0, |most: f64, (_, reading)| most.max(reading.abs()))
    })
}

/// The smallest size of an effect that data without it would have shown with 80 % probability.
pub fn seen_from(maker: &Maker, effect: &str, options: &Options) -> f64 {
    let size = told_of(maker, effect, options).detectable;
    size.unwrap_or_else(|| panic!("{} does not show {effect}", maker.model))
}

/// What data without an effect tell of it.
pub fn told_of(maker: &Maker, effect: &str, options: &Options) -> Hidden {
    told_by(&maker.diagnosed(&[], 1, options), effect)
}

/// What a diagnosis of data without an effect tells of it.
pub fn told_by(bare: &Diagnosis, effect: &str) -> Hidden {
    let own = bare.hidden.iter().find(|h| h.effect == effect).cloned();
    own.unwrap_or_else(|| panic!("{effect} shows with nothing there"))
}

/// A verdict in one word against what was put in.
pub fn judged(diagnosis: &Diagnosis, truth: Option<&str>) -> &'static str {
    let verdict = &diagnosis.verdict;
    let group = || verdict.indistinguishable.iter().flatten();
    match (verdict.kind, truth) {
        (Kind::None, None) => "none, right",
        (Kind::None, Some(_)) => "none",
        (Kind::Unknown, _) => "unknown",
        (Kind::Effect, Some(truth)) => {
            let named = verdict.effects.iter().any(|e| e == truth);
            let grouped = group().any(|e| e == truth);
            match (named, grouped, verdict.effects.len()) {
                (true, false, 1) => "named alone",
                (true, true, 1) | (false, true, 1) => "in its group",
                (true, _, _) | (_, true, _) => "with another",
                (false, false, _) => "another named",
            }
        }
        (Kind::Effect, None) => "another named",
    }
}

/// A verdict against two effects that were put in.
pub fn judged_pair(diagnosis: &Diagnosis, truth: [&str; 2]) -> &'static str {
    let verdict = &diagnosis.verdict;
    let named = |effect: &str| verdict.effects.iter().any(|e| e == effect);
    let grouped = |effect: &str| {
        verdict
            .indistinguishable
            .iter()
            .flatten()
            .any(|e| e == effect)
    };
    let found = |effect: &&str| named(effect) || grouped(effect);
    let stranger = verdict.effects.iter().any(|said| {
        let alike = verdict
            .indistinguishable
            .iter()
            .filter(|group| group.contains(said))
            .flatten();
        !truth.contains(&said.as_str()) && !alike.into_iter().any(|e| truth.contains(&e.as_str()))
    });
    match (verdict.kind, truth.iter().filter(|e| found(e)).count()) {
        (Kind::None, _) => "none",
        (Kind::Unknown, _) => "unknown",
        (Kind::Effect, _) if stranger => "another among them",
        (Kind::Effect, 2) if verdict.indistinguishable.is_empty() => "both named",
        (Kind::Effect, 2) => "both, in groups",
        (Kind::Effect, _) => "one of them",
    }
}
