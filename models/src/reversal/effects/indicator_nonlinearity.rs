//! An indicator's reading is not proportional to its displacement.
//!
//! The calibration curve bends about the indicator's zero: quadratic (a lever at an angle), cubic
//! (a transducer near the end of its range) or both, as the deviation at the greatest reading of all.
//! One of the indicators is curved, or both, each by its own amount. A gain alone is `gain-mismatch`.
//! Free: a deviation for each indicator and power.

use super::Linearised;
use super::indicators::Indicators;
use crate::model::{About, Column, Effect, Link, Parameter, Shape};

/// See the head of the file. Variants: the indicators, quadratic, beyond the scopes cubic, and beyond
/// twice as many both.
pub(super) struct IndicatorNonlinearity(pub Indicators);

/// Powers of the reading, by the kind of a variant.
const KINDS: [&[i32]; 3] = [&[2], &[3], &[2, 3]];

/// The last of them in words.
pub(super) const MIXED: &str = "quadratic and cubic";

impl Effect<Linearised> for IndicatorNonlinearity {
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
        let of = |name| self.0.sizes(shape.variant, &deviation, name);
        if self.powers(shape).len() == 1 {
            return of("deviation");
        }
        [of("deviation-of-square"), of("deviation-of-cube")].concat()
    }

    fn grid(&self, _model: &Linearised) -> Vec<Shape> {
        let kinds = [0, self.0.scope_count()].into_iter();
        kinds
            .flat_map(|kind| {
                let scopes = self.0.scopes();
                scopes.map(move |scope| Shape::variant(kind + scope))
            })
            .collect()
    }

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let kind = 2 * self.0.scope_count();
        let mixed = self.0.scopes().map(|s| Shape::variant(kind + s));
        let mut all = self.grid(model);
        all.extend(mixed);
        all.retain(|other| other.variant != shape.variant);
        all
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let reach = model.reading_reach();
        let bend = |power: &i32| {
            let bend = model.of_reading(|reading| (reading / reach).powi(*power));
            self.0.apart(model, shape.variant, &bend)
        };
        self.powers(shape).iter().flat_map(bend).collect()
    }

    /// The reading rises with what the indicator sees: 1 + Σ p aₚ qᵖ⁻¹/R > 0 for q from −1 to 1.
    fn possible(&self, model: &Linearised, shape: &Shape, amplitudes: &[f64]) -> bool {
        let reach = model.reading_reach();
        let count = amplitudes.len() / self.powers(shape).len();
        (0..count).all(|own| {
            let terms = self
                .powers(shape)
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
        from: &Linearised,
        to: &Linearised,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let grown = to.reading_reach() / from.reading_reach();
        let count = amplitudes.len() / self.powers(shape).len();
        let powers = self
            .powers(shape)
            .iter()
            .flat_map(|p| std::iter::repeat_n(*p, count));
        let carried = amplitudes
            .iter()
            .zip(powers)
            .map(|(a, p)| a * grown.powi(p));
        (shape.clone(), carried.collect())
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        let kind = match self.powers(shape) {
            [2] => "quadratic",
            [3] => "cubic",
            _ => MIXED,
        };
        Some(format!("{kind}, {}", self.0.words(shape.variant)))
    }
}

impl IndicatorNonlinearity {
    fn powers(&self, shape: &Shape) -> &'static [i32] {
        KINDS[(shape.variant / self.0.scope_count()).min(KINDS.len() - 1)]
    }
}
