//! Falling loads read otherwise than rising ones.

use super::CalibrationLine;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// The variant that opens between zero and full scale; the other is as wide everywhere.
const LENS: usize = 0;

/// See the head of the file.
pub(super) struct Hysteresis;

impl Effect<CalibrationLine> for Hysteresis {
    fn name(&self) -> &str {
        "hysteresis"
    }

    fn about(&self) -> About {
        About {
            physics: "falling loads read more than rising ones: the spring relaxes late, the thread or the pointer has play",
            confirm: "load up to full scale and back in one go, and once more with half of the range",
            source: "reversibility of a calibration, ISO 376: a lens between zero and full scale, or a play of constant width",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("width", "y", 1e6)]
    }

    fn grid(&self, model: &CalibrationLine) -> Vec<Shape> {
        let falls = model.places().iter().any(|p| p.direction < 0.0);
        let variants = if falls { 0..2 } else { 0..0 };
        variants.map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &CalibrationLine, shape: &Shape) -> Option<String> {
        let words = match shape.variant {
            LENS => "widest at mid range",
            _ => "as wide everywhere",
        };
        Some(words.to_owned())
    }

    fn columns(&self, model: &CalibrationLine, shape: &Shape) -> Vec<Column> {
        let reach = model.reach();
        vec![Column::from_places(model.places(), |_, place| {
            let load = place.x.abs() / reach;
            let open = match shape.variant {
                LENS => 4.0 * load * (1.0 - load),
                _ => 1.0,
            };
            -0.5 * place.direction * open
        })]
    }
}
