//! The gain of one probe is wrong.
//!
//! What the probe reads comes from the other repeats; without any it is not looked for.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct ProbeGain;

impl Effect<FourierScans> for ProbeGain {
    fn name(&self) -> &str {
        "probe-gain"
    }

    fn about(&self) -> About {
        About {
            physics: "one probe reads too much or too little by a factor",
            confirm: "drive every probe over one step of known height",
            source: "g times the reading of one probe, counted from the mean of its readings",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("gain", "1", 0.2)]
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
        let mean = model.mean_reading(probe);
        vec![Column::from_places(model.places(), |row, _| {
            model.seen_by(probe, row, |reading| reading - mean)
        })]
    }
}
