//! Signatures of effects against their exact forms: noise-free readings with a small effect less the
//! same without it, as far as the fit cannot absorb either.

use errsep_models::calibration_line::CalibrationLine;
use errsep_models::calibration_line::simulate as line;
use errsep_models::circle::{self, CirclePoints, CircleSimulation};
use errsep_models::diagonal::{self, Component, DiagonalRuns, DiagonalSimulation};
use errsep_models::four_sensor::simulate::{Disturbances, Example, simulate};
use errsep_models::four_sensor::{FourSensors, Geometry};
use errsep_models::fourier::{self, FourierScans, FourierSimulation, Section};
use errsep_models::machine::{
    Chain, Machine, MeasuredParts, PartDisturbance, Position, Sense, simulate_parts_disturbed,
};
use errsep_models::model::{FittedModel, Shape};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What the fit of a model without an effect can absorb, as an orthonormal basis (one decomposition for all effects).
struct Bare<M> {
    model: M,
    absorbed: Option<DMatrix<f64>>,
}

impl<M: FittedModel + 'static> Bare<M> {
    fn of(model: M) -> Self {
        let columns = model.freedom().columns;
        let absorbed = (columns.ncols() > 0).then(|| {
            let factor = columns.svd(true, false);
            let u = factor.u.unwrap();
            let greatest = factor.singular_values.amax();
            let kept: Vec<DVector<f64>> = u
                .column_iter()
                .zip(factor.singular_values.iter())
                .filter(|(_, s)| **s > 1e-10 * greatest)
                .map(|(c, _)| c.clone_owned())
                .collect();
            DMatrix::from_columns(&kept)
        });
        Self { model, absorbed }
    }

    /// The part of vectors that the fit cannot absorb.
    fn visible(&self, vectors: &[DVector<f64>]) -> DMatrix<f64> {
        let vectors = DMatrix::from_columns(vectors);
        match &self.absorbed {
            Some(basis) => &vectors - basis * basis.tr_mul(&vectors),
            None => vectors,
        }
    }

    /// How much of the exact change the signature at a shape leaves unexplained, as a part of it.
    fn left(&self, with: &M, effect: &str, shape: &Shape) -> f64 {
        let effects = self.model.effects();
        let effect = effects.iter().find(|e| e.name() == effect).unwrap();
        let n = self.model.observed().len();
        let columns: Vec<DVector<f64>> = effect
            .columns(&self.model, shape)
            .iter()
            .map(|c| c.dense(n))
            .collect();
        let change = self.visible(&[with.linearised() - self.model.linearised()]);
        let columns = self.visible(&columns);
        let svd = columns.clone().svd(true, true);
        let amplitudes = svd
            .solve(&change, 1e-9 * svd.singular_values.amax())
            .unwrap();
        assert!(change.norm() > 0.0);
        (&change - columns * amplitudes).norm() / change.norm()
    }
}

fn at(variant: usize, values: &[f64]) -> Shape {
    Shape {
        variant,
        values: values.to_vec(),
        steps: vec![0.0; values.len()],
    }
}

#[test]
fn calibration_line() {
    let made = |disturbances: Vec<line::Disturbance>| {
        let what = line::CalibrationSimulation {
            line: [0.3, 2.0],
            full_scale: 50.0,
            loads: 12,
            sets: 3,
            both_directions: true,
            noise: 0.0,
            disturbances,
        };
        CalibrationLine::new(&line::simulate(&what, 1).unwrap(), None).unwrap()
    };
    let bare = Bare::of(made(Vec::new()));
    for (name, shape) in [
        ("quadratic", at(0, &[])),
        ("cubic", at(0, &[])),
        ("square-root", at(0, &[])),
        ("logarithmic", at(0, &[])),
        ("saturation", at(0, &[0.2])),
        ("drift", at(0, &[(1.0f64 / 3.0).ln()])),
        ("set-offset", at(2, &[])),
        ("set-slope", at(2, &[])),
        ("sensitivity-drift", at(0, &[(1.0f64 / 3.0).ln()])),
        ("hysteresis", at(0, &[])),
        // 0.55 of 69 readings.
        ("zero-jump", at(0, &[37.5])),
    ] {
        let with = made(vec![line::Disturbance::named(name, 0.1, 3).unwrap()]);
        // Epsilons: these effects are linear; readings of 100 carry 10⁻¹⁴, the change is 10⁻³.
        let rest = bare.left(&with, name, &shape);
        assert!(rest < 1e-9, "{name}: {rest:e}");
    }
}

#[test]
fn circle() {
    let what = |pass: usize| CircleSimulation {
        // Clear of the direction where angles begin again.
        start: 0.01,
        count: 48,
        noise_um: 0.0,
        pass: (pass, 3),
        ..CircleSimulation::default()
    };
    let made = |disturbances: &[circle::Disturbance]| {
        let mut numbered = Vec::new();
        for pass in 0..3 {
            // Dirt lies in one pass only.
            let own: Vec<circle::Disturbance> = disturbances
                .iter()
                .filter(|d| pass == 0 || !matches!(d, circle::Disturbance::Outlier { .. }))
                .copied()
                .collect();
            let points = circle::simulate_disturbed(&what(pass), &own, 1).unwrap();
            numbered.extend(points.into_iter().map(|p| (p, pass as u32 + 1)));
        }
        CirclePoints::new(&numbered, None).unwrap()
    };
    let bare = Bare::of(made(&[]));
    for (name, size, shape) in [
        ("ovality", 1.0, at(0, &[])),
        ("lobes", 1.0, at(0, &[3.0])),
        ("outlier", 1.0, at(16, &[])),
        ("scale-mismatch", 1e-5, at(0, &[])),
        ("squareness", 1e-5, at(0, &[])),
        ("centre-drift", 1.0, at(0, &[])),
        ("radius-growth", 1.0, at(0, &[])),
        ("axis-backlash", 1.0, at(0, &[])),
        ("asynchronous-motion", 1.0, at(0, &[2.4])),
        ("part-moved", 1.0, at(2, &[])),
        // 0.55 of 143 steps.
        ("zero-jump", 1.0, at(0, &[78.65])),
    ] {
        let with = made(&[circle::Disturbance::named(name, size, 48).unwrap()]);
        // Truncation: angles move by the effect over the radius, 1 µm on 50 mm.
        let rest = bare.left(&with, name, &shape);
        assert!(rest < 1e-4, "{name}: {rest:e}");
    }
}

#[test]
fn four_sensor() {
    let geometry = Geometry::new(2.0, [1, 1, 5], 120).unwrap();
    let truth = Example::of(&geometry);
    let made = |put: Option<(&str, f64)>| {
        let mut disturbances = Disturbances::noise(0.0);
        if let Some((name, size)) = put {
            assert!(disturbances.add(name, size));
        }
        let outputs = simulate(&geometry, &truth, &disturbances, 1).unwrap();
        FourSensors::new(&[outputs], Some(0.01)).unwrap()
    };
    let bare = Bare::of(made(None));
    for (name, size, variant, most) in [
        // Epsilons.
        ("drift", 1.0, 2, 1e-9),
        // Truncation: the state comes from the penalised separation, the slope of the surface from a
        // spline through its points 2 mm apart under waves of 25 mm.
        ("gain", 1e-3, 2, 1e-3),
        ("sensor-position", 1e-3, 2, 1e-3),
        ("lag", 1e-3, 2, 1e-3),
        ("nonlinearity", 0.1, 2, 1e-3),
        ("settling", 1.0, 2, 1e-9),
        ("zero-jump", 1.0, 2, 1e-9),
    ] {
        let with = made(Some((name, size)));
        let values: &[f64] = match name {
            "settling" => &[0.25f64.ln()],
            "zero-jump" => &[0.55 * 119.0],
            _ => &[],
        };
        let rest = bare.left(&with, name, &at(variant, values));
        assert!(rest < most, "{name}: {rest:e}");
    }
}

#[test]
fn fourier() {
    let what = FourierSimulation {
        samples: 200,
        repeats: 2,
        orders: 20,
        noise: 0.0,
        ..FourierSimulation::default()
    };
    let section = Section {
        length: what.length,
        orders: what.orders,
    };
    let made = |disturbances: &[fourier::Disturbance]| {
        let (scans, _) = fourier::simulate_disturbed(&what, disturbances, 3).unwrap();
        FourierScans::new(&scans, section, None).unwrap()
    };
    let bare = Bare::of(made(&[]));
    for (name, size, variant, most) in [
        // Epsilons.
        ("height-difference", 1.0, 2, 1e-9),
        // Truncation: second order in the error over the shortest wave, 10⁻³ · 2π/5 mm.
        ("probe-spacing", 1e-3, 2, 5e-3),
        // Truncation: tan of 10⁻⁵ rad.
        ("yaw", 1e-5, 0, 1e-6),
        // The time of the simulation is 200 of 201 steps a scan.
        ("drift", 1.0, 0, 0.02),
        ("thermal-bending", 1.0, 0, 0.02),
        ("zero-jump", 1.0, 5, 1e-9),
        // Second order, and the ends of the section.
        ("travel-scale", 1e-5, 0, 0.02),
        ("gain", 1e-3, 2, 1e-9),
        ("nonlinearity", 1.0, 2, 1e-9),
    ] {
        let with = made(&[fourier::Disturbance::named(name, size, 3).unwrap()]);
        let values: &[f64] = match name {
            "drift" => &[0.15f64.ln()],
            "zero-jump" => &[1100.5],
            _ => &[],
        };
        let rest = bare.left(&with, name, &at(variant, values));
        assert!(rest < most, "{name}: {rest:e}");
    }
}

/// Two probes see what is behind the section.
#[test]
fn fourier_of_two_probes() {
    let what = FourierSimulation {
        samples: 200,
        orders: 20,
        noise: 0.0,
        step: (0.0, 0.0),
        third_probe: false,
        ..FourierSimulation::default()
    };
    let section = Section {
        length: what.length,
        orders: what.orders,
    };
    let made = |disturbances: &[fourier::Disturbance]| {
        let (scans, _) = fourier::simulate_disturbed(&what, disturbances, 3).unwrap();
        FourierScans::new(&scans, section, None).unwrap()
    };
    let bare = Bare::of(made(&[]));
    for (name, size, variant, values) in [
        ("beyond-the-section", 1.0, 0, &[4.95][..]),
        ("gain", 1e-3, 2, &[]),
        ("nonlinearity", 1.0, 2, &[]),
    ] {
        let with = made(&[fourier::Disturbance::named(name, size, 3).unwrap()]);
        let rest = bare.left(&with, name, &at(variant, values));
        // Epsilons.
        assert!(rest < 1e-9, "{name}: {rest:e}");
    }
}

#[test]
fn step_diagonal() {
    let what = DiagonalSimulation {
        rotation: 0.0,
        noise: 0.0,
        mirror: 0.0,
        translation: 1.0,
        ..DiagonalSimulation::default()
    };
    let rotations: Vec<Component> = Component::all().filter(|c| c.rotation).collect();
    let made = |disturbances: &[diagonal::Disturbance]| {
        let (readings, _, _) = diagonal::simulate_disturbed(&what, disturbances, 2);
        DiagonalRuns::new(&what.zone, &readings, &rotations, None).unwrap()
    };
    let bare = Bare::of(made(&[]));
    let of_mirror = bare.model.channels().len() - 1;
    let of_rotation = rotations.iter().position(|c| c.name() == "ECZ").unwrap();
    for (name, size, shape) in [
        ("mirror-misalignment", 1e-6, at(of_mirror, &[])),
        ("angular-error", 1e-6, at(of_rotation, &[])),
        ("drift", 1.0, at(0, &[0.1f64.ln()])),
        ("thermal-expansion", 1e-6, at(0, &[])),
        ("axis-growth", 1.0, at(0, &[])),
        (
            "mirror-creep",
            1e-6,
            at(bare.model.channels().len() / 6 - 1, &[]),
        ),
    ] {
        let disturbance = diagonal::Disturbance::named(name, size, &what).unwrap();
        let shape = if name == "mirror-misalignment" {
            let diagonal::Disturbance::MirrorMisalignment {
                diagonal, sequence, ..
            } = disturbance
            else {
                panic!("{disturbance:?}");
            };
            let of = |c: &(diagonal::Diagonal, diagonal::Target, diagonal::Sequence)| {
                c.0 == diagonal && c.2 == sequence
            };
            at(bare.model.channels().iter().position(of).unwrap(), &[])
        } else {
            shape
        };
        let with = made(&[disturbance]);
        // Truncation: products of the angle with errors of 1 µm and angles of 10⁻⁶.
        let rest = bare.left(&with, name, &shape);
        assert!(rest < 1e-3, "{name}: {rest:e}");
    }
}

#[test]
fn machine() {
    let machine = Machine::new(Chain::parse("FXYZ").unwrap(), Sense::Tool, Vec::new()).unwrap();
    let points: Vec<(String, Position)> =
        [(10.0, 20.0, 0.0), (140.0, 10.0, 50.0), (90.0, 120.0, 20.0)]
            .into_iter()
            .enumerate()
            .map(|(k, (x, y, z))| (k.to_string(), Position::new(x, y, z)))
            .collect();
    let made = |disturbances: &[PartDisturbance]| {
        let readings =
            simulate_parts_disturbed(&machine, &points, 4, 2, 0.0, disturbances, 1).unwrap();
        MeasuredParts::new(&machine, readings).unwrap()
    };
    let bare = Bare::of(made(&[]));
    for name in PartDisturbance::NAMES {
        let size = match name {
            "part-zero" | "datum-offset" | "bad-part" => 10.0,
            "angular-error-times-height" => 1e-8,
            _ => 1e-6,
        };
        let variant = if name == "bad-part" { 2 } else { 0 };
        let with = made(&[PartDisturbance::named(name, size).unwrap()]);
        // Truncation: finite rotations and shears of 10⁻⁶, and rounding of coordinates of 150 mm.
        let rest = bare.left(&with, name, &at(variant, &[]));
        assert!(rest < 1e-5, "{name}: {rest:e}");
    }
}

/// Indicators are set to zero at mid travel, where the form is part of what they read: a gain counted
/// from elsewhere would shift the phase of an error of the reading beside it.
#[test]
fn readings_are_counted_from_mid_travel() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let scene = Scene::random(151, 2, 3e-5, 2.0, SceneNoise::default(), &mut random);
    let model = Linearised::new(&scene.exact(), Assumptions::default()).unwrap();
    let middle = scene.travel() / 2.0;
    let mut form: f64 = 0.0;
    for trace in model.traces() {
        let k = trace.start + 75;
        let place = &model.places()[k];
        assert!((place.x - middle).abs() < 1e-9);
        // The form at mid travel is a micrometre; smoothing may take a hundredth of it.
        assert!((model.mid_reading(place) - model.observed()[k]).abs() < 0.02);
        let line = (model.observed()[trace.start] + model.observed()[trace.end - 1]) / 2.0;
        form = form.max((model.observed()[k] - line).abs());
    }
    assert!(form > 0.5, "{form}");
}

/// What is told relative to the state stays the same function of the reading, in micrometres, in a
/// measurement with another reach and span.
#[test]
fn effects_told_relative_to_the_state_are_carried() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let scene = Scene::random(61, 2, 3e-5, 2.0, SceneNoise::default(), &mut random);
    let model = Linearised::new(&scene.exact(), Assumptions::default()).unwrap();
    let further = model.further();
    let (_, tilted) = further
        .iter()
        .find(|(name, _)| name.contains("tilted"))
        .unwrap();
    assert!(tilted.reading_reach() > 3.0 * model.reading_reach());
    let effects = model.effects();
    for (name, values) in [
        ("indicator-nonlinearity", vec![]),
        ("cyclic-error", vec![5.0]),
    ] {
        let effect = effects.iter().find(|e| e.name() == name).unwrap();
        let shape = at(0, &values);
        let ones = vec![1.0; effect.amplitudes().len()];
        let (there, amplitudes) = effect.carried(&model, tilted, &shape, &ones);
        let columns = effect.columns(tilted, &there);
        // The near indicator's first, then the far one's.
        let (readings, far) = (tilted.observed().len(), columns.len() / 2);
        let first = columns[0].dense(readings) * amplitudes[0]
            + columns[far].dense(readings) * amplitudes[far];
        for k in 0..first.len() {
            let reading = tilted.smooth_reading(k);
            let told = match name {
                "cyclic-error" => {
                    (std::f64::consts::TAU * 5.0 * reading / model.reading_span()).cos()
                }
                _ => (reading / model.reading_reach()).powi(2),
            };
            // Rounding of a phase of some hundred turns, or of a square of some hundred.
            assert!((first[k] - told).abs() < 1e-9 * (1.0 + told), "{name} {k}");
        }
    }
}
