//! An indicator's reading is not proportional to its displacement.
//!
//! The calibration curve bends about the indicator's zero: quadratic (a lever at an angle) or cubic
//! (a transducer near the end of its range), as the deviation at the greatest reading of all. One of
//! the indicators is curved, or both, each by its own amount. A gain alone is `gain-mismatch`.
//! Free: a deviation for each indicator.

use super::FirstOrder;
use super::indicators::{SCOPES, apart, scopes, sizes, words};
use crate::model::{About, Column, Effect, Link, Parameter, Shape};

/// See the head of the file. Variants: the indicators, quadratic and from [`SCOPES`] on cubic.
pub(super) struct IndicatorNonlinearity;

impl Effect<FirstOrder> for IndicatorNonlinearity {
    fn name(&self) -> &str {
        "indicator-nonlinearity"
    }

    fn about(&self) -> About {
        About {
            physics: "an indicator reads a curved function of the displacement, so large and small readings are scaled differently",
            confirm: "calibrate the indicator over the span of the readings, or align so that the readings stay small",
            source: "second and third term of the calibration curve; cosine error of a lever-type indicator",
        }
    }

    fn link(&self) -> Link {
        Link::Sensor
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let deviation = Parameter::symmetric("deviation", "um", 200.0);
        let names = ["deviation", "near-deviation", "far-deviation"];
        sizes(shape.variant, names, &deviation)
    }

    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let kinds = [0, SCOPES].into_iter();
        kinds
            .flat_map(|kind| {
                scopes(model)
                    .iter()
                    .map(move |scope| Shape::variant(kind + scope))
            })
            .collect()
    }

    fn relatives(&self, model: &FirstOrder, shape: &Shape) -> Vec<Shape> {
        let mut all = self.grid(model);
        all.retain(|other| other.variant != shape.variant);
        all
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let reach = model.reading_reach();
        let bend = model.of_reading(|reading| (reading / reach).powi(power(shape)));
        apart(model, shape.variant, &bend)
    }

    fn possible(&self, model: &FirstOrder, shape: &Shape, amplitudes: &[f64]) -> bool {
        let steepest = f64::from(power(shape)) / model.reading_reach();
        // A cube of the reading makes the slope smaller with one sign only, a square with either.
        let falls = |a: f64| if power(shape) == 2 { a.abs() } else { -a };
        amplitudes.iter().all(|a| falls(*a) * steepest < 1.0)
    }

    /// The deviation is told at the greatest reading.
    fn carried(
        &self,
        from: &FirstOrder,
        to: &FirstOrder,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let grown = (to.reading_reach() / from.reading_reach()).powi(power(shape));
        (
            shape.clone(),
            amplitudes.iter().map(|a| a * grown).collect(),
        )
    }

    fn variant_name(&self, _model: &FirstOrder, shape: &Shape) -> Option<String> {
        let kind = if power(shape) == 2 {
            "quadratic"
        } else {
            "cubic"
        };
        Some(format!("{kind}, {}", words(shape.variant)))
    }
}

fn power(shape: &Shape) -> i32 {
    if shape.variant < SCOPES { 2 } else { 3 }
}
