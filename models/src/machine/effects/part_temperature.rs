//! Every part has a temperature of its own.

use nalgebra::DMatrix;

use super::{MeasuredParts, spread};
use crate::model::{About, Column, Effect, Estimate, Parameter, Shape, each};
use crate::units::um_from_mm;

/// Parts whose scales are told one by one; of more their root mean square alone.
const MOST_TOLD: usize = 8;

/// See the head of the file.
pub(super) struct PartTemperature;

impl Effect<MeasuredParts> for PartTemperature {
    fn name(&self) -> &str {
        "part-temperature"
    }

    fn about(&self) -> About {
        About {
            physics: "every part was measured at a temperature of its own, which scales all axes alike, each part by its own share",
            confirm: "record the temperature of every part; measure one part again when it has soaked",
            source: "uniform scale of each part: (x, y, z); expansion times temperature, ISO 1",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("scale", "1", 1e-3)]
    }

    /// One part has the scale of all parts: `thermal-expansion`.
    fn grid(&self, model: &MeasuredParts) -> Vec<Shape> {
        match model.parts().len() {
            0 | 1 => Vec::new(),
            _ => vec![Shape::only()],
        }
    }

    fn estimates(
        &self,
        _shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let mut told = vec![spread("scale-of-parts", "1", amplitudes, covariance, 0, 1)];
        if amplitudes.len() <= MOST_TOLD {
            let scales = (1..=amplitudes.len()).map(|part| Parameter {
                name: format!("scale-of-part-{part}").into(),
                ..Parameter::symmetric("", "1", 1e-3)
            });
            told.extend(each(scales, amplitudes.iter(), covariance));
        }
        told
    }

    fn columns(&self, model: &MeasuredParts, _shape: &Shape) -> Vec<Column> {
        let of = |part: &String| {
            model.column(|r| match r.part == *part {
                true => um_from_mm(r.position[r.axis.index()]),
                false => 0.0,
            })
        };
        model.parts().iter().map(of).collect()
    }
}
