//! The mirror stood otherwise in one sequence.

use super::DiagonalRuns;
use crate::diagonal::Parameter as Parameter21;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct MirrorMisalignment;

impl Effect<DiagonalRuns> for MirrorMisalignment {
    fn name(&self) -> &str {
        "mirror-misalignment"
    }

    fn about(&self) -> About {
        About {
            physics: "the mirror was set anew for one sequence, or was knocked, so that its angle is not that of the other sequences on the same diagonal",
            confirm: "adjust the mirror once for all sequences of a diagonal and repeat that one",
            source: "Soons, equation (4): the angle of the mirror times the offset of the beam on it",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("first-angle", "rad", 1e-2),
            Parameter::symmetric("second-angle", "rad", 1e-2),
        ]
    }

    fn grid(&self, model: &DiagonalRuns) -> Vec<Shape> {
        (0..model.channels().len()).map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &DiagonalRuns, shape: &Shape) -> Option<String> {
        model.channel_names().get(shape.variant).cloned()
    }

    fn columns(&self, model: &DiagonalRuns, shape: &Shape) -> Vec<Column> {
        [0, 1]
            .map(|direction| {
                Column::from_places(model.places(), |row, place| {
                    if place.channel != shape.variant {
                        return 0.0;
                    }
                    model.weighted(row, |parameter| {
                        f64::from(u8::from(matches!(
                            parameter,
                            Parameter21::Mirror(_, _, k) if *k == direction
                        )))
                    })
                })
            })
            .into()
    }
}
