//! The workpiece goes on beyond the section otherwise than it begins.

use super::FourierScans;
use crate::model::Moments;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// Places at which the search begins, a variant.
const MOST: usize = 25;

/// Variants: a step, and another slope from a place on.
const STEP: usize = 0;
const SLOPE: usize = 1;

/// How far past the end of the section the second probe was read, mm.
fn read_past(model: &FourierScans) -> Moments {
    Moments::at((0..model.places().len()).filter_map(|row| model.past_the_end(row)))
}

/// See the head of the file.
pub(super) struct BeyondTheSection;

impl Effect<FourierScans> for BeyondTheSection {
    fn name(&self) -> &str {
        "beyond-the-section"
    }

    fn about(&self) -> About {
        About {
            physics: "behind the end of the section the workpiece does not go on as it begins: two probes read that as if it did",
            confirm: "add a third probe, the length of the section behind the second",
            source: "f(x + d) beyond L is not f(x + d - L): the limit of the two-sensor method; Huang et al. (2022), section 2.1",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("height", "um", 1e4)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("past-the-end", "mm", 0.0, 1e6)]
    }

    fn grid(&self, model: &FourierScans) -> Vec<Shape> {
        let variants = [STEP, SLOPE];
        let shapes = variants.map(|variant| read_past(model).grid(variant, MOST));
        shapes.into_iter().flatten().collect()
    }

    fn moments(&self, model: &FourierScans, shape: &Shape) -> Vec<f64> {
        match shape.variant {
            STEP => read_past(model).all(),
            _ => Vec::new(),
        }
    }

    fn variant_name(&self, _model: &FourierScans, shape: &Shape) -> Option<String> {
        let how = match shape.variant {
            STEP => "a step",
            _ => "another slope",
        };
        Some(how.to_owned())
    }

    fn columns(&self, model: &FourierScans, shape: &Shape) -> Vec<Column> {
        let Some(&from) = shape.values.first() else {
            return Vec::new();
        };
        let past = |row: usize| model.past_the_end(row).map_or(0.0, |u| (u - from).max(0.0));
        let furthest = (0..model.places().len()).map(past).fold(0.0, f64::max);
        if furthest <= 0.0 {
            return Vec::new();
        }
        vec![Column::from_places(model.places(), |row, _| {
            let past = past(row);
            match shape.variant {
                _ if past <= 0.0 => 0.0,
                STEP => -1.0,
                _ => -past / furthest,
            }
        })]
    }
}
