//! The indicator's reading is not proportional to its displacement.

use super::FirstOrder;
use crate::model::{About, Column, Effect, Link, Parameter, Shape};

/// See the head of the file. Variants: quadratic (lever at an angle) and cubic (transducer near the
/// end of its range), both as the deviation at the
/// greatest reading off the indicator's zero.
pub(super) struct IndicatorNonlinearity;

impl Effect<FirstOrder> for IndicatorNonlinearity {
    fn name(&self) -> &str {
        "indicator-nonlinearity"
    }

    fn about(&self) -> About {
        About {
            physics: "both indicators read a curved function of the displacement, so large and small readings are scaled differently",
            confirm: "calibrate the indicator over the span of the readings, or align so that the readings stay small",
            source: "second and third term of the calibration curve; cosine error of a lever-type indicator",
        }
    }

    fn link(&self) -> Link {
        Link::Sensor
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "deviation",
            unit: "um",
            low: -200.0,
            high: 200.0,
        }]
    }

    fn grid(&self, _model: &FirstOrder) -> Vec<Shape> {
        vec![Shape::variant(0), Shape::variant(1)]
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let reach = model.reading_reach();
        vec![model.of_reading(|reading| (reading / reach).powi(power(shape)))]
    }

    fn possible(&self, model: &FirstOrder, shape: &Shape, amplitudes: &[f64]) -> bool {
        let steepest = f64::from(power(shape)) / model.reading_reach();
        // A cube of the reading makes the slope smaller with one sign only, a square with either.
        let falls = |a: f64| if shape.variant == 0 { a.abs() } else { -a };
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
        Some(
            if shape.variant == 0 {
                "quadratic"
            } else {
                "cubic"
            }
            .to_owned(),
        )
    }
}

fn power(shape: &Shape) -> i32 {
    if shape.variant == 0 { 2 } else { 3 }
}
