//! The spacing of the probes is not the stated one.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct ProbeSpacing;

impl Effect<FourierScans> for ProbeSpacing {
    fn name(&self) -> &str {
        "probe-spacing"
    }

    fn about(&self) -> About {
        About {
            physics: "second and third probe stand a little further from the first than stated, so that they read another place of the workpiece",
            confirm: "drive all probes over one sharp edge and read the slide where each sees it",
            source: "f(x + d + e) - f(x + d); Huang et al. (2022), section 4",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("spacing", "mm", 2.0)]
    }

    fn grid(&self, model: &FourierScans) -> Vec<Shape> {
        (0..model.spacings().len()).map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &FourierScans, shape: &Shape) -> Option<String> {
        Some(format!(
            "spacing {} mm",
            model.spacings().get(shape.variant)?
        ))
    }

    fn columns(&self, model: &FourierScans, shape: &Shape) -> Vec<Column> {
        vec![Column::from_places(model.places(), |_, place| {
            if place.channel == shape.variant {
                -model.slope_there(place)
            } else {
                0.0
            }
        })]
    }
}
