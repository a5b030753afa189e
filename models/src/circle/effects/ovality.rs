//! The section is oval.

use nalgebra::DMatrix;

use super::{CirclePoints, amplitude_and_phase, undulations};
use crate::model::{About, Column, Effect, Estimate, Parameter, Shape};

/// See the head of the file.
pub(super) struct Ovality;

impl Effect<CirclePoints> for Ovality {
    fn name(&self) -> &str {
        "ovality"
    }

    fn about(&self) -> About {
        About {
            physics: "the section is oval, bent by clamping or by its own weight, or the axes that measure it are not square",
            confirm: "turn the part by 90 degrees and measure again: an oval part turns with it, an error of the instrument stays",
            source: "two undulations per revolution; ISO 12181-1",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("cosine", "um", 1e4),
            Parameter::symmetric("sine", "um", 1e4),
        ]
    }

    fn estimates(
        &self,
        _shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        amplitude_and_phase(2.0, amplitudes, covariance)
    }

    fn columns(&self, model: &CirclePoints, _shape: &Shape) -> Vec<Column> {
        undulations(model, 2.0)
    }
}
