//! One reading is wrong.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct Outlier;

impl Effect<CirclePoints> for Outlier {
    fn name(&self) -> &str {
        "outlier"
    }

    fn about(&self) -> About {
        About {
            physics: "one reading is wrong: dirt, a scratch, a false trigger",
            confirm: "clean the place and read it again",
            source: "one point off the circle",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("deviation", "um", 1e5)]
    }

    fn grid(&self, model: &CirclePoints) -> Vec<Shape> {
        (0..model.places().len()).map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &CirclePoints, shape: &Shape) -> Option<String> {
        let place = model.places().get(shape.variant)?;
        let angle = place.x.rem_euclid(360.0);
        Some(format!("at {angle:.1} deg, repeat {}", place.repeat))
    }

    fn columns(&self, _model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        vec![Column {
            rows: vec![shape.variant],
            values: vec![1.0],
        }]
    }
}
