//! All parts are measured from another zero.

use super::MeasuredParts;
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Parameter, Shape};

/// See the head of the file.
pub(super) struct DatumOffset;

impl Effect<MeasuredParts> for DatumOffset {
    fn name(&self) -> &str {
        "datum-offset"
    }

    fn about(&self) -> About {
        About {
            physics: "the origin from which all parts are measured is not the one they were made from",
            confirm: "measure the parts from another datum, or the datum itself",
            source: "rigid translation of all points",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("x", "um", 1e3),
            Parameter::symmetric("y", "um", 1e3),
        ]
    }

    fn columns(&self, model: &MeasuredParts, _shape: &Shape) -> Vec<Column> {
        [Axis::X, Axis::Y]
            .map(|axis| model.column(|r| f64::from(u8::from(r.axis == axis))))
            .into()
    }
}
