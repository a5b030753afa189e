//! Measurements of circles, four sensors and step diagonals as a workshop would come by them: forms and
//! effects by formulas of their own, which the signatures of the catalogue meet only nearly.

use std::f64::consts::TAU;

use errsep_models::circle::{CirclePoints, Point};
use errsep_models::diagonal::{
    Component, Diagonal, DiagonalReading, DiagonalRuns, ErrorTables, Sequence, Target, Travel,
    WorkZone, exact_reading,
};
use errsep_models::four_sensor::{FourSensors, Geometry, Outputs};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Effects by their names and sizes.
pub type Put<'a> = &'a [(&'a str, f64)];

const REPEATS: u32 = 4;

struct Chance(ChaCha8Rng);

impl Chance {
    fn of(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn normal(&mut self, sigma: f64) -> f64 {
        let normal: f64 = StandardNormal.sample(&mut self.0);
        sigma * normal
    }

    fn phase(&mut self) -> f64 {
        TAU * self.0.random::<f64>()
    }
}

fn size(put: Put<'_>, effect: &str) -> f64 {
    let mut own = put.iter().filter(|(name, _)| *name == effect);
    own.next().map_or(0.0, |(_, size)| *size)
}

/// Radial noise of the circle, µm.
pub const CIRCLE_NOISE: f64 = 1.0;

/// Four passes of 72 points over a part of 50 mm, beside the machine's zero. Clamped oval it is an ellipse;
/// its lobes are of three jaws, steeper on one side; the two axes of the machine share a mismatch; dirt lies
/// under one point of one pass.
pub fn circle(put: Put<'_>, seed: u64) -> CirclePoints {
    let mut chance = Chance::of(seed);
    let (radius, oval, lobe) = (50.0, 1e-3 * size(put, "ovality"), 1e-3 * size(put, "lobes"));
    let (turned, phase) = (chance.phase(), chance.phase());
    let mismatch = size(put, "scale-mismatch");
    let dirt = (chance.0.random_range(0..72), size(put, "outlier"));
    let mut points = Vec::new();
    for repeat in 1..=REPEATS {
        for k in 0..72 {
            let angle = TAU * f64::from(k) / 72.0;
            let own = angle - turned;
            let ellipse = (radius + oval) * (radius - oval)
                / ((radius - oval) * own.cos()).hypot((radius + oval) * own.sin());
            let jaws = 3.0 * angle + phase;
            let fallen = if repeat == 1 && k == dirt.0 {
                1e-3 * dirt.1
            } else {
                0.0
            };
            let noise = chance.normal(1e-3 * CIRCLE_NOISE);
            let r = ellipse + lobe * (jaws + 0.1 * jaws.sin()).cos() + fallen + noise;
            let point = Point::new(
                (12.0 + r * angle.cos()) * (1.0 + 0.5 * mismatch),
                (r * angle.sin() - 7.0) * (1.0 - 0.5 * mismatch),
            );
            points.push((point, repeat));
        }
    }
    CirclePoints::new(&points, None).expect("a circle passes through the points")
}

/// Noise of a sensor, µm.
pub const SENSOR_NOISE: f64 = 0.1;

/// Four runs of four sensors over a surface of three waves. The third sensor stands elsewhere, reads too
/// much, or creeps towards its temperature with twice the duration of a run.
pub fn four_sensor(put: Put<'_>, seed: u64) -> FourSensors {
    let geometry = Geometry::new(5.0, [1, 1, 5], 62).expect("a geometry");
    let mut chance = Chance::of(seed);
    let length = (geometry.point_count() - 1) as f64 * geometry.step();
    let phases: [f64; 6] = std::array::from_fn(|_| chance.phase());
    let wave = |x: f64, turns: f64, phase: f64| (TAU * turns * x / length + phase).sin();
    let surface = |x: f64| {
        4.0 * wave(x, 5.3, phases[0]) + 3.0 * wave(x, 8.7, phases[1]) + wave(x, 12.1, phases[2])
    };
    let slide = |x: f64| 6.0 * (x / length - 0.4).powi(3) + 2.0 * wave(x, 2.2, phases[3]);
    let tilt = |x: f64| 1e-5 * (wave(x, 1.4, phases[4]) + 0.5 * wave(x, 3.1, phases[5]));
    let zeros: [f64; 4] = std::array::from_fn(|_| chance.normal(2.0));
    let travel = (geometry.output_count() - 1) as f64 * geometry.step();
    let repeats: Vec<Outputs> = (0..REPEATS)
        .map(|_| {
            let rows = (0..geometry.output_count()).map(|row| {
                let x = row as f64 * geometry.step();
                std::array::from_fn(|sensor| {
                    let own = |effect| if sensor == 2 { size(put, effect) } else { 0.0 };
                    let nominal = geometry.offsets()[sensor] as f64 * geometry.step();
                    let place = nominal + own("sensor-position");
                    let seen = surface(x + place) + slide(x) + 1e3 * place * tilt(x);
                    let crept = (1.0 - (-0.5 * x / travel).exp()) / (1.0 - (-0.5f64).exp());
                    (seen + zeros[sensor]) * (1.0 + own("gain"))
                        + own("drift") * crept
                        + chance.normal(SENSOR_NOISE)
                })
            });
            Outputs::new(geometry, 0.0, rows.collect()).expect("readings of this geometry")
        })
        .collect();
    FourSensors::new(&repeats, None).expect("sensors that can be separated")
}

/// Noise of the laser, µm.
pub const LASER_NOISE: f64 = 0.2;

/// Four body diagonals in three sequences, four runs each. The mirror of the last sequence is a plane at an
/// angle; the laser drifts as a hyperbola; Z turns about itself not quite evenly, where no turn is assumed.
pub fn step_diagonal(put: Put<'_>, seed: u64) -> DiagonalRuns {
    let zone = WorkZone {
        travel: [600.0, 500.0, 400.0],
        steps: 5,
    };
    let mut chance = Chance::of(seed);
    let errors = machine(&zone, size(put, "angular-error"), &mut chance);
    let sequences = [Sequence::XYZ, Sequence::YZX, Sequence::ZXY];
    let mut readings = Vec::new();
    for diagonal in Diagonal::BODY {
        let mirror = Vector3::from_fn(|_, _| chance.normal(5e-5));
        for sequence in sequences {
            let is_last = diagonal == Diagonal::BODY[3] && sequence == sequences[2];
            let angle = if is_last {
                size(put, "mirror-misalignment")
            } else {
                0.0
            };
            let along = diagonal.direction(&zone);
            let across = along.cross(&Vector3::z()).normalize();
            let mut stops = zone.stops(diagonal, sequence);
            stops.dedup();
            for repeat in 1..=REPEATS {
                readings.extend(stops.iter().map(|&at| {
                    let way = zone.position(at) - diagonal.start(&zone);
                    let (target, travel) = (Target::Mirror, Travel::Forward);
                    let read = exact_reading(&zone, &errors, diagonal, target, mirror, at, travel);
                    DiagonalReading {
                        diagonal,
                        target,
                        sequence,
                        repeat,
                        travel,
                        at,
                        value: read
                            + 1e3 * angle.tan() * way.dot(&across)
                            + chance.normal(LASER_NOISE),
                    }
                }));
            }
        }
    }
    drift(&mut readings, size(put, "drift"));
    let rotations: Vec<Component> = Component::all().filter(|c| c.rotation).collect();
    DiagonalRuns::new(&zone, &readings, &rotations, None).expect("runs that determine something")
}

/// Translations that bend and wave, no rotation but that of Z about itself.
fn machine(zone: &WorkZone, angle: f64, chance: &mut Chance) -> ErrorTables {
    let mut errors = ErrorTables::zero(zone);
    let part = |i: usize| i as f64 / zone.steps as f64;
    for component in Component::all().filter(|c| !c.rotation) {
        let (bend, wave, phase) = (chance.normal(5.0), chance.normal(3.0), chance.phase());
        for (i, value) in errors.of_mut(component).iter_mut().enumerate() {
            let t = part(i);
            *value = bend * t * t + wave * ((4.0 * t + phase).sin() - phase.sin());
        }
    }
    let turn = Component::from_name("ECZ").expect("the turn of Z about itself");
    for (i, value) in errors.of_mut(turn).iter_mut().enumerate() {
        let t = part(i);
        *value = angle * (t + 0.08 * (0.5 * TAU * t).sin());
    }
    errors
}

/// Half of a drift is there after a tenth of the test; the laser is zeroed at the beginning of each run.
fn drift(readings: &mut [DiagonalReading], size: f64) {
    let last = readings.len().saturating_sub(1).max(1) as f64;
    let drifted = |k: usize| {
        let t = k as f64 / last;
        size * 1.1 * t / (t + 0.1)
    };
    let mut zero = 0.0;
    for k in 0..readings.len() {
        let begins = k == 0 || {
            let (now, before) = (&readings[k], &readings[k - 1]);
            (now.diagonal, now.sequence, now.repeat)
                != (before.diagonal, before.sequence, before.repeat)
        };
        if begins {
            zero = drifted(k);
        }
        readings[k].value += drifted(k) - zero;
    }
}
