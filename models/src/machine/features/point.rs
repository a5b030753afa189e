//! One coordinate of one point.

use nalgebra::Vector3;

use crate::machine::{Axis, Functional, Machine, MachineError, Position, Weight};

/// The deviation of one point along one direction, um.
///
/// # Errors
/// A position outside a table or not finite.
pub fn point(
    machine: &Machine,
    position: &Position,
    direction: Axis,
) -> Result<Functional, MachineError> {
    let mut gradient = Vector3::zeros();
    gradient[direction.index()] = 1.0;
    Ok(Functional {
        label: format!("deviation along {}", direction.letter()),
        unit: "um".into(),
        value: machine.deviation(position)?[direction.index()],
        weights: vec![Weight {
            position: *position,
            gradient,
        }],
    })
}
