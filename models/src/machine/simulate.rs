//! Readings of a machine whose errors are known.

use nalgebra::{Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::model::coordinate;
use super::{
    Axis, Component, Independence, Kind, Machine, MachineError, Observation, PartReading, Position,
    Prediction, Sampler,
};
use crate::units::{mm_from_um, um_from_mm};

/// How the components are measured one by one.
#[derive(Debug, Clone, PartialEq)]
pub struct Characterization {
    /// Stations along each axis, mm.
    pub stations: Vec<f64>,
    /// Readings at each station, and of each error of location.
    pub repeats: usize,
}

/// Readings of every component of a machine: its function plus its scatter, component after
/// component.
///
/// # Errors
/// A station outside a table.
pub fn simulate_characterization(
    machine: &Machine,
    plan: &Characterization,
    seed: u64,
) -> Result<Vec<(Component, Observation)>, MachineError> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut readings = Vec::new();
    for error in machine.errors() {
        let stations: &[f64] = match error.component.kind {
            Kind::Squareness => &[0.0],
            Kind::Translation | Kind::Rotation => &plan.stations,
        };
        for &station in stations {
            let position = coordinate(error.component, &Position::repeat(station));
            let value = error.function.value(error.component, position)?;
            for repeat in 1..=plan.repeats {
                let noise: f64 = StandardNormal.sample(&mut generator);
                let value = value + error.spread.scatter.sqrt() * noise;
                readings.push((
                    error.component,
                    Observation {
                        position,
                        value,
                        repeat: repeat as u32,
                    },
                ));
            }
        }
    }
    Ok(readings)
}

/// What is wrong with the parts beside the machine, in exact form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PartDisturbance {
    /// All parts are measured from a zero shifted by so much in x, um.
    DatumOffset(f64),
    /// All parts are measured in a frame turned by this angle, rad.
    DatumRotation(f64),
    /// All coordinates are too great by this share.
    ThermalExpansion(f64),
    /// x is too great by this share.
    AxisScale(f64),
    /// x falls with y by this angle, rad.
    SquarenessChange(f64),
    /// x grows with x and the height, rad/mm.
    AngularErrorTimesHeight(f64),
    /// Standard deviation of each part's own zero, um.
    PartZero(f64),
    /// Standard deviation of each part's own angle, rad.
    PartRotation(f64),
    /// Standard deviation of each part's own scale.
    PartTemperature(f64),
    /// The third part lies off by so much along x and half as much along y, um.
    BadPart(f64),
}

impl PartDisturbance {
    /// The names that [`Self::named`] knows.
    pub const NAMES: [&'static str; 10] = [
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
    ];

    /// A disturbance by the name of its effect and its size.
    #[must_use]
    pub fn named(name: &str, size: f64) -> Option<Self> {
        Some(match name {
            "angular-error-times-height" => Self::AngularErrorTimesHeight(size),
            "axis-scale" => Self::AxisScale(size),
            "bad-part" => Self::BadPart(size),
            "datum-offset" => Self::DatumOffset(size),
            "datum-rotation" => Self::DatumRotation(size),
            "part-rotation" => Self::PartRotation(size),
            "part-temperature" => Self::PartTemperature(size),
            "part-zero" => Self::PartZero(size),
            "squareness-change" => Self::SquarenessChange(size),
            "thermal-expansion" => Self::ThermalExpansion(size),
            _ => return None,
        })
    }
}

/// How one part is made and lies, mm and rad: scales first, then the shear, the turn, the shift.
struct Lie {
    scale: Position,
    shear: f64,
    lever: f64,
    turn: f64,
    shift: Position,
}

impl Lie {
    fn of(part: usize, disturbances: &[PartDisturbance], generator: &mut ChaCha8Rng) -> Self {
        let mut lie = Self {
            scale: Position::repeat(1.0),
            shear: 0.0,
            lever: 0.0,
            turn: 0.0,
            shift: Position::zeros(),
        };
        let mut normal = || -> f64 { StandardNormal.sample(generator) };
        for disturbance in disturbances {
            match *disturbance {
                PartDisturbance::DatumOffset(um) => lie.shift.x += mm_from_um(um),
                PartDisturbance::DatumRotation(angle) => lie.turn += angle,
                PartDisturbance::ThermalExpansion(share) => lie.scale *= 1.0 + share,
                PartDisturbance::AxisScale(share) => lie.scale.x *= 1.0 + share,
                PartDisturbance::SquarenessChange(angle) => lie.shear += angle,
                PartDisturbance::AngularErrorTimesHeight(per_mm) => lie.lever += per_mm,
                PartDisturbance::PartZero(um) => {
                    lie.shift.x += mm_from_um(um) * normal();
                    lie.shift.y += mm_from_um(um) * normal();
                }
                PartDisturbance::PartRotation(angle) => lie.turn += angle * normal(),
                PartDisturbance::PartTemperature(share) => lie.scale *= 1.0 + share * normal(),
                PartDisturbance::BadPart(um) if part == 3 => {
                    lie.shift += Position::new(mm_from_um(um), mm_from_um(0.5 * um), 0.0);
                }
                PartDisturbance::BadPart(_) => {}
            }
        }
        lie
    }

    /// Where a point at `nominal` with a deviation (um) is found, um off its nominal place.
    fn found(&self, nominal: &Position, deviation: &Position) -> Position {
        let mut at = (nominal + deviation.map(mm_from_um)).component_mul(&self.scale);
        at.x += at.z * (self.lever * at.x).sin() - at.y * self.shear.tan();
        let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), self.turn) * at;
        (turned + self.shift - nominal).map(um_from_mm)
    }
}

/// Parts made on the machine and measured `replicates` times with a noise of `noise_um`, X and Y of
/// every feature.
///
/// # Errors
/// A feature outside a table; a noise that is negative or not finite.
pub fn simulate_parts(
    machine: &Machine,
    features: &[(String, Position)],
    parts: usize,
    replicates: u32,
    noise_um: f64,
    seed: u64,
) -> Result<Vec<PartReading>, MachineError> {
    simulate_parts_disturbed(machine, features, parts, replicates, noise_um, &[], seed)
}

/// [`simulate_parts`] with disturbances.
///
/// # Errors
/// Those of [`simulate_parts`].
pub fn simulate_parts_disturbed(
    machine: &Machine,
    features: &[(String, Position)],
    parts: usize,
    replicates: u32,
    noise_um: f64,
    disturbances: &[PartDisturbance],
    seed: u64,
) -> Result<Vec<PartReading>, MachineError> {
    if !(noise_um.is_finite() && noise_um >= 0.0) {
        return Err(MachineError::NotFinite {
            what: "the noise of a reading",
            found: noise_um,
        });
    }
    let points: Vec<Position> = features.iter().map(|(_, p)| *p).collect();
    let sampler = Sampler::new(machine, &points, Independence::Scatter, Prediction::Future)?
        .with_known_spreads();
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut deviations = vec![Position::zeros(); points.len()];
    let mut readings = Vec::new();
    for part in 1..=parts {
        sampler.draw(&mut generator, &mut deviations);
        let lie = Lie::of(part, disturbances, &mut generator);
        for ((feature, position), deviation) in features.iter().zip(&deviations) {
            let found = if disturbances.is_empty() {
                *deviation
            } else {
                lie.found(position, deviation)
            };
            for axis in [Axis::X, Axis::Y] {
                for replicate in 1..=replicates {
                    let noise: f64 = StandardNormal.sample(&mut generator);
                    readings.push(PartReading {
                        part: part.to_string(),
                        feature: feature.clone(),
                        axis,
                        replicate,
                        position: *position,
                        value: found[axis.index()] + noise_um * noise,
                    });
                }
            }
        }
    }
    Ok(readings)
}
