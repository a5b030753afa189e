//! The section has lobes.

use nalgebra::DMatrix;

use super::{CirclePoints, amplitude_and_phase, undulations};
use crate::model::{About, Column, Effect, Estimate, Parameter, Shape};

/// Most undulations looked for.
const MOST: usize = 50;

/// See the head of the file.
pub(super) struct Lobes;

impl Effect<CirclePoints> for Lobes {
    fn name(&self) -> &str {
        "lobes"
    }

    fn about(&self) -> About {
        About {
            physics: "the section has three or more lobes: jaws of a chuck, centreless grinding, chatter",
            confirm: "turn the part by half a lobe and measure again, or compare with the number of jaws",
            source: "waves of n undulations per revolution; ISO 12181-1",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("cosine", "um", 1e4),
            Parameter::symmetric("sine", "um", 1e4),
        ]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("undulations", "1", 3.0, MOST as f64)]
    }

    fn grid(&self, model: &CirclePoints) -> Vec<Shape> {
        // Four points a wave or more.
        (3..=(model.points_of_a_pass() / 4).min(MOST))
            .map(|count| Shape {
                variant: 0,
                values: vec![count as f64],
                steps: vec![0.0],
            })
            .collect()
    }

    fn variant_name(&self, _model: &CirclePoints, shape: &Shape) -> Option<String> {
        Some(format!("{} undulations", shape.values.first()?))
    }

    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        amplitude_and_phase(
            shape.values.first().copied().unwrap_or(1.0),
            amplitudes,
            covariance,
        )
    }

    fn columns(&self, model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        shape
            .values
            .first()
            .map_or_else(Vec::new, |count| undulations(model, *count))
    }
}
