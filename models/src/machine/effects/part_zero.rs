//! Every part has a zero of its own.

use nalgebra::DMatrix;

use super::{MeasuredParts, spread};
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Estimate, Parameter, Shape};

/// See the head of the file.
pub(super) struct PartZero;

impl Effect<MeasuredParts> for PartZero {
    fn name(&self) -> &str {
        "part-zero"
    }

    fn about(&self) -> About {
        About {
            physics: "every part is clamped or its zero is found a little elsewhere",
            confirm: "clamp and measure one part several times, unclamping it in between",
            source: "rigid translation of each part",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("x", "um", 1e3),
            Parameter::symmetric("y", "um", 1e3),
        ]
    }

    fn estimates(
        &self,
        _shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        vec![
            spread("x-of-parts", "um", amplitudes, covariance, 0, 2),
            spread("y-of-parts", "um", amplitudes, covariance, 1, 2),
        ]
    }

    fn columns(&self, model: &MeasuredParts, _shape: &Shape) -> Vec<Column> {
        model
            .parts()
            .iter()
            .flat_map(|part| {
                [Axis::X, Axis::Y].map(|axis| {
                    model.column(|r| f64::from(u8::from(r.axis == axis && r.part == *part)))
                })
            })
            .collect()
    }
}
