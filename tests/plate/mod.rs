//! Plates measured on a coordinate measuring machine, by geometry in full: a turned plate, axes that are not
//! square, scales, and a guide that runs along an arc of a circle.
#![allow(dead_code, reason = "each program uses its part")]

use errsep_models::machine::{Axis, Chain, Machine, MeasuredParts, PartReading, Position, Sense};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// What is wrong with the machine: scales as shares, squareness in rad, sagitta of the bend in mm over the plate.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wrong {
    pub scale_x: f64,
    pub scale_y: f64,
    pub squareness: f64,
    /// Of the motion along X, seen along Y.
    pub sagitta: f64,
}

/// Side of the plate, mm.
const SIDE: f64 = 400.0;

/// Where a plate lay.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    /// About z, rad.
    pub turn: f64,
    /// Of the datum, mm.
    shift: (f64, f64),
    /// Where the middle of the points is, less where it should be, µm.
    pub middle_um: [f64; 2],
}

/// The pose of the plate of this seed.
pub fn pose(seed: u64) -> Pose {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let mut any = |most: f64| most * (2.0 * random.random::<f64>() - 1.0);
    let (turn, shift) = (any(2e-4), (any(0.05), any(0.05)));
    let middle = turned((SIDE / 2.0, SIDE / 2.0), turn, shift);
    Pose {
        turn,
        shift,
        middle_um: [(middle.0 - SIDE / 2.0) * 1e3, (middle.1 - SIDE / 2.0) * 1e3],
    }
}

fn turned((x, y): (f64, f64), turn: f64, shift: (f64, f64)) -> (f64, f64) {
    (
        x * turn.cos() - y * turn.sin() + shift.0,
        x * turn.sin() + y * turn.cos() + shift.1,
    )
}

fn aligned(readings: Vec<PartReading>) -> MeasuredParts {
    let machine = Machine::new(Chain::parse("FXYZ").unwrap(), Sense::Tool, Vec::new()).unwrap();
    MeasuredParts::new(&machine, readings)
        .unwrap()
        .aligned()
        .unwrap()
}

/// A plate of 6 × 6 points, measured four times in one clamping.
pub fn plate(wrong: Wrong, noise_um: f64, seed: u64) -> MeasuredParts {
    plate_turned(wrong, noise_um, seed, pose(seed).turn)
}

/// The same that lies turned by so many rad.
pub fn plate_turned(wrong: Wrong, noise_um: f64, seed: u64, turn: f64) -> MeasuredParts {
    aligned(measured(wrong, noise_um, seed, turn, ("plate", 0.0)))
}

/// Steel, 1/K.
pub const EXPANSION: f64 = 11.5e-6;

/// Plates of steel, each so many kelvins warmer than when it was calibrated and with a pose of its own.
pub fn warm_plates(wrong: Wrong, kelvins: &[f64], noise_um: f64, seed: u64) -> MeasuredParts {
    let plates = kelvins.iter().enumerate().flat_map(|(k, warmer)| {
        let own = 100 * seed + k as u64;
        let name = format!("plate {}", k + 1);
        measured(wrong, noise_um, own, pose(own).turn, (&name, *warmer))
    });
    aligned(plates.collect())
}

/// Two plates without noise, turned by so many rad, read to a step: their repeats agree to its last digit.
pub fn plates_read_to(step_um: f64, turn: f64) -> MeasuredParts {
    let of = |(name, seed): (&str, u64)| {
        let readings = measured(Wrong::default(), 0.0, seed, turn, (name, 0.0)).into_iter();
        let to_step = readings.map(|r| PartReading {
            value: (r.value / step_um).round() * step_um,
            ..r
        });
        to_step.collect::<Vec<_>>()
    };
    aligned(
        [("first", 5), ("second", 7)]
            .into_iter()
            .flat_map(of)
            .collect(),
    )
}

/// The readings of one plate that lies turned by so many rad: its name, and by how many kelvins it is warm.
fn measured(
    wrong: Wrong,
    noise_um: f64,
    seed: u64,
    turn: f64,
    (part, warmer): (&str, f64),
) -> Vec<PartReading> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let Pose { shift, .. } = pose(seed);
    let noise = Normal::new(0.0, noise_um * 1e-3).unwrap();
    let mut readings = Vec::new();
    for replicate in 1..=4 {
        for i in 0..6 {
            for j in 0..6 {
                let (x, y) = (SIDE * f64::from(i) / 5.0, SIDE * f64::from(j) / 5.0);
                let grown = 1.0 + EXPANSION * warmer;
                let place = turned((x * grown, y * grown), turn, shift);
                let read = (
                    place.0 * (1.0 + wrong.scale_x) - place.1 * wrong.squareness.tan(),
                    place.1 * (1.0 + wrong.scale_y) + arc(place.0, wrong.sagitta),
                );
                for (axis, read, nominal) in [(Axis::X, read.0, x), (Axis::Y, read.1, y)] {
                    readings.push(PartReading {
                        part: part.to_owned(),
                        feature: format!("{i}{j}"),
                        axis,
                        replicate,
                        position: Position::new(x, y, 0.0),
                        value: (read + noise.sample(&mut random) - nominal) * 1e3,
                    });
                }
            }
        }
    }
    readings
}

/// A rod along x of which y and z were measured at one place only, and z at one of x: its turn about y
/// cannot be told from its zero of z.
pub fn line() -> MeasuredParts {
    let reading = |axis, x: f64, value| PartReading {
        part: "rod".to_owned(),
        feature: format!("{x}"),
        axis,
        replicate: 1,
        position: Position::new(x, 0.0, 0.0),
        value,
    };
    aligned(vec![
        reading(Axis::Y, 0.0, 1.0),
        reading(Axis::Y, 100.0, 2.0),
        reading(Axis::Y, 200.0, 2.5),
        reading(Axis::Z, 50.0, 4.0),
    ])
}

/// Height of an arc of a circle over its chord, with this sagitta over the side of the plate.
fn arc(x: f64, sagitta: f64) -> f64 {
    if sagitta == 0.0 {
        return 0.0;
    }
    let half = SIDE / 2.0;
    let radius = (half * half + sagitta * sagitta) / (2.0 * sagitta.abs());
    // Of sin² of half the angle, without the difference of two great numbers.
    let drop = 2.0 * radius * (((x - half) / radius).asin() / 2.0).sin().powi(2);
    sagitta.signum() * (sagitta.abs() - drop)
}
