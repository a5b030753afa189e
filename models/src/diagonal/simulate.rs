//! Step-diagonal data of a machine with known errors.

use super::components::{Component, NodeKind};
use super::diagonals::{Diagonal, Sequence, Target, Travel, WorkZone};
use super::errors::ErrorTables;
use super::geometry::exact_reading;
use super::readings::DiagonalReading;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What to simulate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagonalSimulation {
    /// The box.
    pub zone: WorkZone,
    /// Diagonals measured.
    pub diagonals: Vec<Diagonal>,
    /// Targets, each with all diagonals and sequences.
    pub targets: Vec<Target>,
    /// Sequences measured.
    pub sequences: Vec<Sequence>,
    /// Repeats of each run.
    pub repeats: u32,
    /// Size of the translational errors, µm.
    pub translation: f64,
    /// Size of the angular and squareness errors, rad.
    pub rotation: f64,
    /// Standard deviation of the mirror's misalignment about each direction, rad.
    pub mirror: f64,
    /// Standard deviation of each reading, µm.
    pub noise: f64,
    /// Whether each run goes back to its start.
    pub backward: bool,
    /// Size of the reversal of the translational errors, µm.
    pub reversal: f64,
    /// Size of the reversal of the angular errors, rad.
    pub reversal_rotation: f64,
}

impl Default for DiagonalSimulation {
    fn default() -> Self {
        Self {
            zone: WorkZone {
                travel: [600.0, 500.0, 400.0],
                steps: 5,
            },
            diagonals: Diagonal::BODY.to_vec(),
            targets: vec![Target::Mirror],
            sequences: Sequence::STEPS.to_vec(),
            repeats: 1,
            translation: 5.0,
            rotation: 20e-6,
            mirror: 50e-6,
            noise: 0.2,
            backward: false,
            reversal: 0.0,
            reversal_rotation: 0.0,
        }
    }
}

/// Angles (rad) of the reflector of each set-up out of its nominal direction.
pub type Misalignments = BTreeMap<(Diagonal, Target), Vector3<f64>>;

/// What disturbs the readings beside noise, in exact form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// The mirror is turned about the first of [`Diagonal::mirror_axes`] for one sequence, rad.
    MirrorMisalignment {
        /// Diagonal.
        diagonal: Diagonal,
        /// Sequence.
        sequence: Sequence,
        /// Angle, rad.
        angle: f64,
    },
    /// One rotation grows evenly along its axis.
    AngularError {
        /// The rotation.
        component: Component,
        /// At the end of the travel, rad.
        angle: f64,
    },
    /// The dead path changes evenly, by so much over the test, µm; each run begins at zero.
    DeadPath(f64),
    /// The machine settles.
    Drift {
        /// In the end, µm.
        drift: f64,
        /// Time constant as a part of the duration.
        constant: f64,
    },
    /// All scales grow by this share over the test.
    ThermalExpansion(f64),
    /// The X axis grows by so much at the end of its travel over the test, µm.
    AxisGrowth(f64),
    /// The laser loses so much in the last run, after its first third, µm.
    LostCounts(f64),
    /// The mirror of the last diagonal turns about the first of [`Diagonal::mirror_axes`] by so much while
    /// its runs are taken, rad.
    MirrorCreep(f64),
}

impl Disturbance {
    /// The names that [`Self::named`] knows.
    pub const NAMES: [&'static str; 8] = [
        "angular-error",
        "axis-growth",
        "dead-path",
        "drift",
        "lost-counts",
        "mirror-creep",
        "mirror-misalignment",
        "thermal-expansion",
    ];

    /// A disturbance by the name of its effect and its size, µm, rad or a share; what these leave open is
    /// usual: the rotation of Z about itself, a time constant of a tenth of the duration, the last of
    /// the diagonals and sequences.
    pub fn named(name: &str, size: f64, what: &DiagonalSimulation) -> Option<Self> {
        Some(match name {
            "mirror-misalignment" => Self::MirrorMisalignment {
                diagonal: *what.diagonals.last()?,
                sequence: *what.sequences.last()?,
                angle: size,
            },
            "angular-error" => Self::AngularError {
                component: Component::from_name("ECZ")?,
                angle: size,
            },
            "dead-path" => Self::DeadPath(size),
            "drift" => Self::Drift {
                drift: size,
                constant: 0.1,
            },
            "thermal-expansion" => Self::ThermalExpansion(size),
            "axis-growth" => Self::AxisGrowth(size),
            "lost-counts" => Self::LostCounts(size),
            "mirror-creep" => Self::MirrorCreep(size),
            _ => return None,
        })
    }
}

/// Readings by exact geometry, the errors they were made of and the misalignment of each set-up.
pub fn simulate(
    what: &DiagonalSimulation,
    seed: u64,
) -> (Vec<DiagonalReading>, ErrorTables, Misalignments) {
    simulate_disturbed(what, &[], seed)
}

/// [`simulate`] with disturbances; readings are taken evenly in time.
pub fn simulate_disturbed(
    what: &DiagonalSimulation,
    disturbances: &[Disturbance],
    seed: u64,
) -> (Vec<DiagonalReading>, ErrorTables, Misalignments) {
    let zone = &what.zone;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut errors = random_errors(zone, what.translation, what.rotation, &mut rng);
    for disturbance in disturbances {
        if let Disturbance::AngularError { component, angle } = *disturbance {
            for (i, value) in errors.of_mut(component).iter_mut().enumerate() {
                *value += angle * i as f64 / zone.steps as f64;
            }
        }
    }
    // A stream of its own, so that a seed gives the same machine with and without reversal.
    let mut apart = ChaCha8Rng::seed_from_u64(seed);
    apart.set_stream(1);
    random_reversals(&mut errors, what, &mut apart);
    let travels = match what.backward {
        true => &Travel::ALL[..],
        false => &[Travel::Forward],
    };
    let mut mirrors = BTreeMap::new();
    let mut readings = Vec::new();
    for &target in &what.targets {
        for &diagonal in &what.diagonals {
            let mirror = Vector3::from_fn(|_, _| what.mirror * normal(&mut rng));
            mirrors.insert((diagonal, target), mirror);
            for &sequence in &what.sequences {
                let turned = turned_mirror(zone, disturbances, diagonal, sequence, mirror);
                for repeat in 1..=what.repeats.max(1) {
                    for &travel in travels {
                        let mut stops = distinct(zone.stops(diagonal, sequence));
                        if travel == Travel::Backward {
                            stops.reverse();
                        }
                        readings.extend(stops.into_iter().map(|at| DiagonalReading {
                            diagonal,
                            target,
                            sequence,
                            repeat,
                            travel,
                            at,
                            value: exact_reading(
                                zone, &errors, diagonal, target, turned, at, travel,
                            ) + what.noise * normal(&mut rng),
                        }));
                    }
                }
            }
        }
    }
    add_drifts(&mut readings, disturbances);
    add_growths(zone, &mut readings, disturbances);
    (readings, errors, mirrors)
}

/// The mirror of one sequence.
fn turned_mirror(
    zone: &WorkZone,
    disturbances: &[Disturbance],
    diagonal: Diagonal,
    sequence: Sequence,
    mirror: Vector3<f64>,
) -> Vector3<f64> {
    let axis = diagonal.mirror_axes(zone).into_iter().next();
    disturbances
        .iter()
        .filter_map(|disturbance| match *disturbance {
            Disturbance::MirrorMisalignment {
                diagonal: d,
                sequence: s,
                angle,
            } if d == diagonal && s == sequence => Some(axis? * angle),
            _ => None,
        })
        .fold(mirror, |sum, turn| sum + turn)
}

/// What grows with time, from the zero at the beginning of each run.
fn add_drifts(readings: &mut [DiagonalReading], disturbances: &[Disturbance]) {
    let last = readings.len().saturating_sub(1).max(1) as f64;
    let drifted = |moment: f64| -> f64 {
        disturbances
            .iter()
            .map(|disturbance| match *disturbance {
                Disturbance::DeadPath(size) => size * moment,
                Disturbance::Drift { drift, constant } => {
                    drift * (1.0 - (-moment / constant).exp()) / (1.0 - (-1.0 / constant).exp())
                }
                _ => 0.0,
            })
            .sum()
    };
    let mut zero = 0.0;
    let mut run = None;
    for (order, reading) in readings.iter_mut().enumerate() {
        let now = drifted(order as f64 / last);
        if run.replace(reading.run()) != Some(reading.run()) {
            zero = now;
        }
        reading.value += now - zero;
    }
}

/// What grows with time and place, from the zero at the beginning of each run, and lost counts.
fn add_growths(zone: &WorkZone, readings: &mut [DiagonalReading], disturbances: &[Disturbance]) {
    let last = readings.len().saturating_sub(1).max(1) as f64;
    let Some(end) = readings.last().copied() else {
        return;
    };
    let own = |r: &DiagonalReading| (r.diagonal, r.target) == (end.diagonal, end.target);
    let first_of_last = readings.iter().position(own).unwrap_or(0) as f64;
    let run_starts = readings
        .iter()
        .position(|r| r.run() == end.run())
        .unwrap_or(0);
    let run_length = readings.len() - run_starts;
    let grown = |order: usize, reading: &DiagonalReading| -> f64 {
        let moment = order as f64 / last;
        let at = zone.position(reading.at);
        let direction = reading.diagonal.direction(zone);
        let start = reading.diagonal.start(zone);
        let of = |disturbance: &Disturbance| match *disturbance {
            Disturbance::ThermalExpansion(share) => {
                1e3 * share * moment * direction.dot(&(at - start))
            }
            Disturbance::AxisGrowth(size) => size * moment * direction.x * (at.x / zone.travel[0]),
            Disturbance::LostCounts(size) => {
                let lost = order >= run_starts + run_length / 3;
                if lost { size } else { 0.0 }
            }
            Disturbance::MirrorCreep(angle) if own(reading) => {
                let part = (order as f64 - first_of_last) / (last - first_of_last).max(1.0);
                let turn = reading.diagonal.mirror_axes(zone).into_iter().next();
                // The mirror turns about the axis; the beam meets it off the diagonal by what the sequence has
                // not yet travelled.
                let off = at - start - direction * direction.dot(&(at - start));
                turn.map_or(0.0, |axis| {
                    1e3 * angle * part * axis.cross(&off).dot(&direction)
                })
            }
            _ => 0.0,
        };
        disturbances.iter().map(of).sum()
    };
    let mut zero = 0.0;
    let mut run = None;
    let all: Vec<f64> = readings
        .iter()
        .enumerate()
        .map(|(k, r)| grown(k, r))
        .collect();
    for (reading, now) in readings.iter_mut().zip(all) {
        if run.replace(reading.run()) != Some(reading.run()) {
            zero = now;
        }
        reading.value += now - zero;
    }
}

fn distinct(mut stops: Vec<[usize; 3]>) -> Vec<[usize; 3]> {
    stops.dedup();
    stops
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A slope, a bend and a wave in each function; zero at corner A, straightness zero at both ends.
fn random_errors(
    zone: &WorkZone,
    translation: f64,
    rotation: f64,
    rng: &mut ChaCha8Rng,
) -> ErrorTables {
    let mut errors = ErrorTables::zero(zone);
    for component in Component::all() {
        let size = if component.rotation {
            rotation
        } else {
            translation
        };
        let (slope, bend, wave) = (normal(rng), normal(rng), normal(rng));
        let phase = rng.random_range(0.0..std::f64::consts::TAU);
        let shape = |t: f64| slope * t + bend * t * t + 0.5 * wave * (9.0 * t + phase).sin();
        let (first, last) = (shape(0.0), shape(1.0));
        let chord = match component.kind() {
            NodeKind::Straightness => last - first,
            NodeKind::Positioning | NodeKind::Angular => 0.0,
        };
        for (i, value) in errors.of_mut(component).iter_mut().enumerate() {
            let t = i as f64 / zone.steps as f64;
            *value = size * (shape(t) - first - chord * t);
        }
    }
    errors.squareness = std::array::from_fn(|_| rotation * normal(rng));
    errors
}

/// A constant and a change along the axis in each.
fn random_reversals(errors: &mut ErrorTables, what: &DiagonalSimulation, rng: &mut ChaCha8Rng) {
    for component in Component::all() {
        let size = if component.rotation {
            what.reversal_rotation
        } else {
            what.reversal
        };
        let (constant, change) = (normal(rng), 0.5 * normal(rng));
        let values = errors.reversal_of_mut(component);
        let last = values.len().saturating_sub(1).max(1) as f64;
        for (i, value) in values.iter_mut().enumerate() {
            let t = i as f64 / last;
            *value = size * (constant + change * t * (2.0 - t));
        }
    }
}
