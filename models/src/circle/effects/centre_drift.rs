//! The centre moves while the points are taken.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct CentreDrift;

impl Effect<CirclePoints> for CentreDrift {
    fn name(&self) -> &str {
        "centre-drift"
    }

    fn about(&self) -> About {
        About {
            physics: "part and probe move against each other while the points are taken: spindle or fixture warm up",
            confirm: "measure the first points again at the end",
            source: "an even drift of the centre along x and y; ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("along-x", "um", 1e4),
            Parameter::symmetric("along-y", "um", 1e4),
        ]
    }

    fn columns(&self, model: &CirclePoints, _shape: &Shape) -> Vec<Column> {
        [f64::cos, f64::sin]
            .map(|along| {
                Column::from_places(model.places(), |_, place| {
                    model.moment(place) * along(CirclePoints::angle(place))
                })
            })
            .into()
    }
}
