//! Every part is turned a little.

use nalgebra::DMatrix;

use super::{MeasuredParts, spread};
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Estimate, Parameter, Shape};
use crate::units::um_from_mm;

/// See the head of the file.
pub(super) struct PartRotation;

impl Effect<MeasuredParts> for PartRotation {
    fn name(&self) -> &str {
        "part-rotation"
    }

    fn about(&self) -> About {
        About {
            physics: "every part is aligned a little otherwise, so that its holes turn about its datum",
            confirm: "align and measure one part several times, taking it off in between",
            source: "rigid rotation of each part about its datum",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("angle", "rad", 1e-2)]
    }

    fn estimates(
        &self,
        _shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        vec![spread(
            "angle-of-parts",
            "rad",
            amplitudes,
            covariance,
            0,
            1,
        )]
    }

    fn columns(&self, model: &MeasuredParts, _shape: &Shape) -> Vec<Column> {
        model
            .parts()
            .iter()
            .map(|part| {
                model.column(|r| {
                    if r.part != *part {
                        return 0.0;
                    }
                    match r.axis {
                        Axis::X => -um_from_mm(r.position.y),
                        Axis::Y => um_from_mm(r.position.x),
                        Axis::Z => 0.0,
                    }
                })
            })
            .collect()
    }
}
