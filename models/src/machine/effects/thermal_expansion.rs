//! Parts were warmer when made than when measured.

use super::MeasuredParts;
use crate::model::{About, Column, Effect, Parameter, Shape};
use crate::units::um_from_mm;

/// See the head of the file.
pub(super) struct ThermalExpansion;

impl Effect<MeasuredParts> for ThermalExpansion {
    fn name(&self) -> &str {
        "thermal-expansion"
    }

    fn about(&self) -> About {
        About {
            physics: "parts were warmer or colder when made than when measured, which scales all axes alike, as scales of the axes do that are off alike",
            confirm: "record the temperature of a part at both times, and of the scales of the axes",
            source: "uniform scale from the datum: (x, y, z)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("scale", "1", 1e-3)]
    }

    fn columns(&self, model: &MeasuredParts, _shape: &Shape) -> Vec<Column> {
        vec![model.column(|r| um_from_mm(r.position[r.axis.index()]))]
    }
}
