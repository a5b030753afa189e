//! The distance between two points (NISTIR 6868, section 4.4 and appendix D).

use nalgebra::Vector3;

use crate::machine::{Functional, Machine, MachineError, Position, Weight};
use crate::units::{mm_from_um, um_from_mm};

/// The error of the distance between two points, um, and its dependence on their deviations
/// (equations 33 and D4).
///
/// # Errors
/// Points that coincide; a position outside a table or not finite.
pub fn length(
    machine: &Machine,
    from: &Position,
    to: &Position,
) -> Result<Functional, MachineError> {
    let nominal = to - from;
    let direction = nominal
        .try_normalize(0.0)
        .ok_or_else(|| MachineError::BadFeature {
            feature: "length",
            why: "its two points coincide".into(),
        })?;
    let change = machine.deviation(to)? - machine.deviation(from)?;
    Ok(Functional {
        label: "length error".into(),
        unit: "um".into(),
        value: length_of(&nominal, &change),
        weights: vec![
            Weight {
                position: *from,
                gradient: -direction,
            },
            Weight {
                position: *to,
                gradient: direction,
            },
        ],
    })
}

/// Change (um) of the length of a nominal vector (mm) whose end moves by `change` (um) relative to
/// its start. Written as `(2 n·c + c·c) / (L + L0)`, so that a length of metres costs no digits.
#[must_use]
pub fn length_of(nominal: &Vector3<f64>, change: &Vector3<f64>) -> f64 {
    let change = change.map(mm_from_um);
    let sum = (nominal + change).norm() + nominal.norm();
    um_from_mm((2.0 * nominal.dot(&change) + change.norm_squared()) / sum)
}
