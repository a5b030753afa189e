//! The third probe stands higher in the scans of one spacing.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct HeightDifference;

impl Effect<FourierScans> for HeightDifference {
    fn name(&self) -> &str {
        "height-difference"
    }

    fn about(&self) -> About {
        About {
            physics: "the third probe stands higher against the second in the scans of one spacing than in the others: it was set anew with the spacing",
            confirm: "read both probes on one place of the workpiece before and after the spacing is changed",
            source: "step at the joint; Huang et al. (2022), equation (15)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("height", "um", 1e4)]
    }

    fn grid(&self, model: &FourierScans) -> Vec<Shape> {
        // The step that all spacings share is the slope of the workpiece; with two spacings the one
        // is the other turned round.
        let spacings = model.spacings().len();
        let first = usize::from(spacings == 2);
        (first..spacings).map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &FourierScans, shape: &Shape) -> Option<String> {
        Some(format!(
            "spacing {} mm",
            model.spacings().get(shape.variant)?
        ))
    }

    fn columns(&self, model: &FourierScans, shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            let here = place.channel == shape.variant && model.beyond(place);
            -f64::from(u8::from(here))
        })]
    }
}
