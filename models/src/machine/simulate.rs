//! Readings of a machine whose errors are known.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::model::coordinate;
use super::{
    Axis, Component, Independence, Kind, Machine, MachineError, Observation, PartReading, Position,
    Prediction, Sampler,
};

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
            for _ in 0..plan.repeats {
                let noise: f64 = StandardNormal.sample(&mut generator);
                let value = value + error.spread.scatter.sqrt() * noise;
                readings.push((error.component, Observation { position, value }));
            }
        }
    }
    Ok(readings)
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
        for ((feature, position), deviation) in features.iter().zip(&deviations) {
            for axis in [Axis::X, Axis::Y] {
                for replicate in 1..=replicates {
                    let noise: f64 = StandardNormal.sample(&mut generator);
                    readings.push(PartReading {
                        part: part.to_string(),
                        feature: feature.clone(),
                        axis,
                        replicate,
                        position: *position,
                        value: deviation[axis.index()] + noise_um * noise,
                    });
                }
            }
        }
    }
    Ok(readings)
}
