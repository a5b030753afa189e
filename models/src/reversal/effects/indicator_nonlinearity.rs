//! An indicator's reading is not proportional to its displacement.
//!
//! The calibration curve bends about the indicator's zero: quadratic (a lever at an angle), cubic
//! (a transducer near the end of its range) or both, as the deviation at the greatest reading of all.
//! One of the indicators is curved, or both, each by its own amount. A gain alone is `gain-mismatch`.
//! Free: a deviation for each indicator and power.

use super::FirstOrder;
use super::indicators::{SCOPES, apart, scopes, sizes, words};
use crate::model::{About, Column, Effect, Link, Parameter, Shape};

/// See the head of the file. Variants: the indicators, quadratic, from [`SCOPES`] on cubic, and from
/// twice that on both.
pub(super) struct IndicatorNonlinearity;

/// Powers of the reading, by the kind of a variant.
const KINDS: [&[i32]; 3] = [&[2], &[3], &[2, 3]];

/// The last of them in words.
pub(super) const MIXED: &str = "quadratic and cubic";

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
        let of = |names| sizes(shape.variant, names, &deviation);
        if powers(shape).len() == 1 {
            return of(["deviation", "near-deviation", "far-deviation"]);
        }
        let square = of([
            "deviation-of-square",
            "near-deviation-of-square",
            "far-deviation-of-square",
        ]);
        let cube = of([
            "deviation-of-cube",
            "near-deviation-of-cube",
            "far-deviation-of-cube",
        ]);
        [square, cube].concat()
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
        let mixed = scopes(model).iter().map(|s| Shape::variant(2 * SCOPES + s));
        let mut all = self.grid(model);
        all.extend(mixed);
        all.retain(|other| other.variant != shape.variant);
        all
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let reach = model.reading_reach();
        let bend = |power: &i32| {
            let bend = model.of_reading(|reading| (reading / reach).powi(*power));
            apart(model, shape.variant, &bend)
        };
        powers(shape).iter().flat_map(bend).collect()
    }

    /// The reading rises with what the indicator sees: 1 + Σ p aₚ qᵖ⁻¹/R > 0 for q from −1 to 1.
    fn possible(&self, model: &FirstOrder, shape: &Shape, amplitudes: &[f64]) -> bool {
        let reach = model.reading_reach();
        let count = amplitudes.len() / powers(shape).len();
        (0..count).all(|own| {
            let terms = powers(shape)
                .iter()
                .zip(amplitudes[own..].iter().step_by(count));
            let (mut square, mut cube) = (0.0, 0.0);
            for (power, a) in terms {
                *(if *power == 2 { &mut square } else { &mut cube }) = *a;
            }
            let slope = |q: f64| 1.0 + (2.0 * square * q + 3.0 * cube * q * q) / reach;
            // The parabola's vertex, where it lies inside.
            let vertex = if cube > 0.0 {
                (-square / (3.0 * cube)).clamp(-1.0, 1.0)
            } else {
                1.0
            };
            [-1.0, vertex, 1.0].into_iter().all(|q| slope(q) > 0.0)
        })
    }

    /// The deviation is told at the greatest reading.
    fn carried(
        &self,
        from: &FirstOrder,
        to: &FirstOrder,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let grown = to.reading_reach() / from.reading_reach();
        let count = amplitudes.len() / powers(shape).len();
        let powers = powers(shape)
            .iter()
            .flat_map(|p| std::iter::repeat_n(*p, count));
        let carried = amplitudes
            .iter()
            .zip(powers)
            .map(|(a, p)| a * grown.powi(p));
        (shape.clone(), carried.collect())
    }

    fn variant_name(&self, _model: &FirstOrder, shape: &Shape) -> Option<String> {
        let kind = match powers(shape) {
            [2] => "quadratic",
            [3] => "cubic",
            _ => MIXED,
        };
        Some(format!("{kind}, {}", words(shape.variant)))
    }
}

fn powers(shape: &Shape) -> &'static [i32] {
    KINDS[(shape.variant / SCOPES).min(KINDS.len() - 1)]
}
