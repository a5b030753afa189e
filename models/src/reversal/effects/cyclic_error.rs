//! An error that comes back with a fixed period.
//!
//! Of the reading: the interpolation error of an incremental indicator, of one or of both, each with
//! its own amplitude and phase, up to two readings a period; the reading climbs unevenly, so that
//! periods stay apart up to there. Of the position: the part of a screw's or rack's period that the
//! slide's form cannot take up, different in the two spindle positions. Free: amplitude and phase of
//! each indicator, the period, told by its cycles over the span of the readings or the travel.

use nalgebra::DMatrix;

use super::indicators::{BOTH, FAR, NEAR, apart, scopes, signs};
use super::{FirstOrder, rotating, rotations};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Shape};

/// See the head of the file. Variants: the indicators, then [`DRIVE`].
pub(super) struct CyclicError;

/// Variant of a period of the position.
const DRIVE: usize = 3;

/// Cycles between neighbouring starts of the search: the peak of a period is one cycle wide.
const STRIDE: f64 = 0.4;

/// Greatest slope of a period of the reading: its amplitude is half the period. Beyond, readings a
/// whole period apart show the same, and none tells what was seen.
const STEEPEST: f64 = std::f64::consts::PI;

/// Fewest cycles: less is a bend.
const FEWEST: f64 = 3.0;

impl Effect<FirstOrder> for CyclicError {
    fn name(&self) -> &str {
        "cyclic-error"
    }

    fn about(&self) -> About {
        About {
            physics: "an error comes back with a fixed period, of the indicator's scale or of the drive",
            confirm: "compare the period with the signal period of the indicator and the pitch of the screw",
            source: "first harmonic of the interpolation error of incremental scales; ISO 230-2 periodic error",
        }
    }

    fn link(&self) -> Link {
        Link::Sensor
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::variant(BOTH))
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        rotations(if shape.variant == BOTH { 2 } else { 1 }, 100.0)
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("cycles", "1", 1.0, 1e6)]
    }

    /// Both indicators are found from either.
    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let alone = scopes(model).iter().copied().filter(|s| *s != BOTH);
        let mut shapes = Vec::new();
        for variant in alone.chain([DRIVE]) {
            let mut cycles = FEWEST;
            while cycles <= highest(model) {
                shapes.push(Shape {
                    variant,
                    values: vec![cycles],
                    steps: vec![0.5 * STRIDE],
                });
                cycles += STRIDE;
            }
        }
        shapes
    }

    fn relatives(&self, model: &FirstOrder, shape: &Shape) -> Vec<Shape> {
        let other = |variant: &usize| Shape {
            variant: *variant,
            ..shape.clone()
        };
        if shape.variant == DRIVE {
            return Vec::new();
        }
        let others = scopes(model).iter().filter(|s| **s != shape.variant);
        others.map(other).collect()
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let Some(&cycles) = shape.values.first() else {
            return Vec::new();
        };
        let turn = std::f64::consts::TAU * cycles;
        if shape.variant == DRIVE {
            let first = model.positions().first().copied().unwrap_or(0.0);
            let per_mm = turn / model.travel();
            // In one spindle position only; the fit spreads it over both.
            let wave = |function: fn(f64) -> f64| {
                Column::from_places(model.places(), |_, place| {
                    let seen = model.channel(place).spindle_sign() > 0.0;
                    f64::from(seen) * function(per_mm * (place.x - first))
                })
            };
            return vec![wave(f64::cos), wave(f64::sin)];
        }
        let per_um = turn / model.reading_span();
        let wave = |function: fn(f64) -> f64| {
            let whole = model.of_reading(|reading| function(per_um * reading));
            apart(model, shape.variant, &whole)
        };
        // The cosine and the sine of each indicator stand together.
        let pairs = wave(f64::cos).into_iter().zip(wave(f64::sin));
        pairs.flat_map(|(cosine, sine)| [cosine, sine]).collect()
    }

    fn allowed(&self, model: &FirstOrder, shape: &Shape) -> bool {
        let reach = FEWEST - 0.5..highest(model) + 0.5;
        shape
            .values
            .first()
            .is_some_and(|cycles| reach.contains(cycles))
    }

    fn possible(&self, model: &FirstOrder, shape: &Shape, amplitudes: &[f64]) -> bool {
        let Some(&cycles) = shape.values.first() else {
            return true;
        };
        let steepest = std::f64::consts::TAU * cycles / model.reading_span();
        let holds = |wave: &[f64]| wave[0].hypot(wave[1]) * steepest < STEEPEST;
        shape.variant == DRIVE || amplitudes.chunks_exact(2).all(holds)
    }

    /// A period of the reading is told by its cycles over the span of the readings.
    fn carried(
        &self,
        from: &FirstOrder,
        to: &FirstOrder,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let mut shape = shape.clone();
        if shape.variant != DRIVE {
            let grown = to.reading_span() / from.reading_span();
            shape.values.iter_mut().for_each(|cycles| *cycles *= grown);
        }
        (shape, amplitudes.to_vec())
    }

    fn variant_name(&self, model: &FirstOrder, shape: &Shape) -> Option<String> {
        let cycles = shape.values.first()?;
        let of = match shape.variant {
            DRIVE => {
                return Some(format!(
                    "period {:.4} mm of the travel",
                    model.travel() / cycles
                ));
            }
            NEAR => "near indicator's reading",
            FAR => "far indicator's reading",
            _ => "reading",
        };
        Some(format!(
            "period {:.4} µm of the {of}",
            model.reading_span() / cycles
        ))
    }

    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let waves = if shape.variant == DRIVE {
            1
        } else {
            signs(shape.variant).len()
        };
        rotating(
            waves,
            shape,
            amplitudes,
            covariance,
            &self.shape_parameters(),
        )
    }
}

/// Most cycles: two readings a period.
fn highest(model: &FirstOrder) -> f64 {
    0.5 * model.positions().len() as f64
}
