//! A rotation that was taken as zero is there.

use super::DiagonalRuns;
use crate::diagonal::{Component, Parameter as Parameter21};
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

fn rotations() -> impl Iterator<Item = Component> {
    Component::all().filter(|c| c.rotation)
}

/// See the head of the file.
pub(super) struct AngularError;

impl Effect<DiagonalRuns> for AngularError {
    fn name(&self) -> &str {
        "angular-error"
    }

    fn about(&self) -> About {
        About {
            physics: "a slide turns evenly along its travel although that rotation was assumed to be zero",
            confirm: "leave the assumption out and measure enough sequences, or measure the rotation with an autocollimator",
            source: "Soons, equations (1) and (4), one rotation growing evenly",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-end-of-travel", "rad", 1e-3)]
    }

    fn grid(&self, _model: &DiagonalRuns) -> Vec<Shape> {
        (0..rotations().count()).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &DiagonalRuns, shape: &Shape) -> Option<String> {
        let component = rotations().nth(shape.variant)?;
        Some(format!("{}, {}", component.name(), component.words()))
    }

    fn columns(&self, model: &DiagonalRuns, shape: &Shape) -> Vec<Column> {
        let Some(component) = rotations().nth(shape.variant) else {
            return Vec::new();
        };
        let steps = model.steps() as f64;
        vec![Column::from_places(model.places(), |row, _| {
            model.weighted(row, |parameter| match parameter {
                Parameter21::Node(c, index) if *c == component => *index as f64 / steps,
                _ => 0.0,
            })
        })]
    }
}
