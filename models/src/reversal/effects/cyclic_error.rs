//! An error that comes back periodically.

use nalgebra::DMatrix;

use super::FirstOrder;
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Shape};

/// See the head of the file. Variants: 0, periodic in the reading (interpolation error of an
/// incremental indicator); 1, periodic in position and different in the two spindle positions
/// (the part of a screw's or rack's period that the slide's form cannot take up).
pub(super) struct CyclicError;

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
        let part = |name| Parameter {
            name,
            unit: "um",
            low: -100.0,
            high: 100.0,
        };
        vec![part("cosine"), part("sine")]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "cycles",
            unit: "1",
            low: 1.0,
            high: 1e6,
        }]
    }

    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let highest = 0.25 * model.positions().len() as f64;
        let mut shapes = Vec::new();
        for variant in 0..2 {
            let mut cycles = 3.0;
            while cycles <= highest {
                shapes.push(Shape {
                    variant,
                    values: vec![cycles],
                    steps: vec![0.2],
                });
                cycles += 0.4;
            }
        }
        shapes
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let Some(&cycles) = shape.values.first() else {
            return Vec::new();
        };
        let turn = std::f64::consts::TAU * cycles;
        let first = model.positions().first().copied().unwrap_or(0.0);
        let of_travel = |function: fn(f64) -> f64| {
            let values: Vec<f64> = model
                .positions()
                .iter()
                .map(|x| function(turn * (x - first) / model.travel()))
                .collect();
            // In one spindle position only; the fit spreads it over both.
            Column::from_places(model.places(), |_, place| {
                let seen = model.channel(place).spindle_sign() > 0.0;
                f64::from(seen) * values[place.cell % values.len()]
            })
        };
        let wave = |function: fn(f64) -> f64| {
            if shape.variant == 0 {
                model.of_reading(|reading| function(turn * reading / model.reading_span()))
            } else {
                of_travel(function)
            }
        };
        vec![wave(f64::cos), wave(f64::sin)]
    }

    fn allowed(&self, model: &FirstOrder, shape: &Shape) -> bool {
        let highest = 0.3 * model.positions().len() as f64;
        shape
            .values
            .first()
            .is_some_and(|cycles| *cycles > 2.5 && *cycles < highest)
    }

    fn possible(&self, model: &FirstOrder, shape: &Shape, amplitudes: &[f64]) -> bool {
        let (&[cosine, sine], Some(&cycles)) = (amplitudes, shape.values.first()) else {
            return true;
        };
        let steepest = std::f64::consts::TAU * cycles / model.reading_span();
        shape.variant != 0 || cosine.hypot(sine) * steepest < 1.0
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
        if shape.variant == 0 {
            let grown = to.reading_span() / from.reading_span();
            shape.values.iter_mut().for_each(|cycles| *cycles *= grown);
        }
        (shape, amplitudes.to_vec())
    }

    fn variant_name(&self, model: &FirstOrder, shape: &Shape) -> Option<String> {
        let cycles = shape.values.first()?;
        Some(if shape.variant == 0 {
            format!(
                "period {:.4} µm of the reading",
                model.reading_span() / cycles
            )
        } else {
            format!("period {:.4} mm of the travel", model.travel() / cycles)
        })
    }

    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let (&[cosine, sine], Some(&cycles)) = (amplitudes, shape.values.first()) else {
            return Vec::new();
        };
        let size = cosine.hypot(sine).max(f64::MIN_POSITIVE);
        let (c, s) = (cosine / size, sine / size);
        let at = |i: usize, j: usize| covariance.get((i, j)).map_or(f64::NAN, |v| *v);
        let variance = c * c * at(0, 0) + 2.0 * c * s * at(0, 1) + s * s * at(1, 1);
        vec![
            Estimate {
                name: "amplitude".to_owned(),
                value: size,
                std: variance.max(0.0).sqrt(),
                unit: "um".to_owned(),
            },
            Estimate {
                name: "cycles".to_owned(),
                value: cycles,
                std: at(2, 2).max(0.0).sqrt(),
                unit: "1".to_owned(),
            },
        ]
    }
}
