//! One axis grows while the runs are taken.

use super::DiagonalRuns;
use crate::diagonal::{Component, NodeKind, Parameter as Parameter21};
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

fn positionings() -> impl Iterator<Item = Component> {
    Component::all().filter(|c| c.kind() == NodeKind::Positioning)
}

/// See the head of the file.
pub(super) struct AxisGrowth;

impl Effect<DiagonalRuns> for AxisGrowth {
    fn name(&self) -> &str {
        "axis-growth"
    }

    fn about(&self) -> About {
        About {
            physics: "the screw of one axis warms and grows while the runs are taken",
            confirm: "record the temperature of the screws, and repeat the first run at the end",
            source: "positioning of one axis in proportion to its travel and to time; ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-end-of-travel", "um", 1e3)]
    }

    fn grid(&self, _model: &DiagonalRuns) -> Vec<Shape> {
        (0..positionings().count()).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &DiagonalRuns, shape: &Shape) -> Option<String> {
        let component = positionings().nth(shape.variant)?;
        Some(format!("{}, {}", component.name(), component.words()))
    }

    fn columns(&self, model: &DiagonalRuns, shape: &Shape) -> Vec<Column> {
        let Some(component) = positionings().nth(shape.variant) else {
            return Vec::new();
        };
        let steps = model.steps() as f64;
        vec![Column::from_places(model.places(), |row, place| {
            let run = model.weighted(row, |parameter| match parameter {
                Parameter21::Node(c, index) if *c == component => *index as f64 / steps,
                _ => 0.0,
            });
            // Where a run is zeroed at the far end, that end grows on while the run lasts.
            model.moment(place) * (run + model.zeroed_at(place, shape.variant))
        })]
    }
}
