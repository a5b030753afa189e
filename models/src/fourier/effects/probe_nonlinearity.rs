//! The characteristic of one probe is bent.
//!
//! What the probe reads comes from the other repeats; without any it is not looked for.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct ProbeNonlinearity;

impl Effect<FourierScans> for ProbeNonlinearity {
    fn name(&self) -> &str {
        "probe-nonlinearity"
    }

    fn about(&self) -> About {
        About {
            physics: "the reading of one probe bends over its range: an inductive or capacitive probe far from its middle",
            confirm: "calibrate the probe over its range with gauge blocks, or repeat nearer to its middle",
            source: "the square of the reading about the probe's zero, as great as told at its greatest reading",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-reach", "um", 1e3)]
    }

    fn grid(&self, model: &FourierScans) -> Vec<Shape> {
        model
            .probes()
            .map(|probe| Shape::variant(probe - 1))
            .collect()
    }

    fn variant_name(&self, _model: &FourierScans, shape: &Shape) -> Option<String> {
        Some(format!("probe {}", shape.variant + 1))
    }

    fn columns(&self, model: &FourierScans, shape: &Shape) -> Vec<Column> {
        let probe = shape.variant + 1;
        let reach = model.reach_of(probe);
        vec![Column::from_places(model.places(), |row, _| {
            model.seen_by(probe, row, |reading| (reading / reach).powi(2))
        })]
    }
}
