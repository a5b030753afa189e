//! The workpiece bends while the scans are taken.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct ThermalBending;

impl Effect<FourierScans> for ThermalBending {
    fn name(&self) -> &str {
        "thermal-bending"
    }

    fn about(&self) -> About {
        About {
            physics: "the workpiece bends evenly while the scans are taken: one side is warmer, or its clamps give way",
            confirm: "repeat the first scan at the end, and after an hour at rest",
            source: "an arc of the workpiece that grows with time, (1 - exp(-t / tau)) for tau without end; ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("arc-at-the-end", "um", 1e3)]
    }

    fn columns(&self, model: &FourierScans, _shape: &Shape) -> Vec<Column> {
        let arc = |share: f64| 4.0 * share * (1.0 - share);
        vec![Column::from_places(model.places(), |_, place| {
            let there = model.share(place) + model.share_of_arm(place);
            model.moment(place) * (arc(model.share(place)) - arc(there))
        })]
    }
}
