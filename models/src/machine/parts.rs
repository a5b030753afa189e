//! Measured parts against the model that was to predict them.

use super::{Axis, Machine, MachineError, Position};

/// One measured coordinate of a feature of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct PartReading {
    /// The part.
    pub part: String,
    /// The feature, such as the number of a hole.
    pub feature: String,
    /// The direction measured.
    pub axis: Axis,
    /// Number of the replicate, from 1.
    pub replicate: u32,
    /// Nominal place of the feature, mm.
    pub position: Position,
    /// Measured less nominal coordinate, um.
    pub value: f64,
}

/// A reading with its prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct PartResidual {
    /// The reading.
    pub reading: PartReading,
    /// What the model says, um.
    pub predicted: f64,
    /// Standard uncertainty of that prediction for a new part, um.
    pub standard_uncertainty: f64,
    /// Reading less prediction, um.
    pub residual: f64,
}

impl PartResidual {
    /// The residual in units of the prediction's standard uncertainty; `None` when that is zero.
    #[must_use]
    pub fn normalized(&self) -> Option<f64> {
        (self.standard_uncertainty > 0.0).then(|| self.residual / self.standard_uncertainty)
    }
}

/// The residuals of a model that is not fitted to the parts: none of its parameters moves.
///
/// # Errors
/// A position outside a table, a reading that is not finite.
pub fn part_residuals(
    machine: &Machine,
    readings: &[PartReading],
) -> Result<Vec<PartResidual>, MachineError> {
    readings
        .iter()
        .map(|reading| {
            if !reading.value.is_finite() {
                return Err(MachineError::NotFinite {
                    what: "a reading",
                    found: reading.value,
                });
            }
            let direction = reading.axis.index();
            let predicted = machine.deviation(&reading.position)?[direction];
            let variance: f64 = machine
                .errors()
                .iter()
                .map(|error| {
                    let motion = machine.sensitivity(error.component, &reading.position)[direction];
                    let at = super::model::coordinate(error.component, &reading.position);
                    motion * motion * (error.spread.of_function(at) + error.spread.scatter)
                })
                .sum();
            Ok(PartResidual {
                reading: reading.clone(),
                predicted,
                standard_uncertainty: variance.sqrt(),
                residual: reading.value - predicted,
            })
        })
        .collect()
}
