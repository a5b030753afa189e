//! The air of the room comes and goes in temperature, and machine and mounts follow it.
//!
//! A sinusoid in time with the period of the room's control, longer than two traces and up to the
//! duration of the test. Each indicator follows by its own amount and its own lag. Free: amplitude
//! and phase for each indicator, the period, told by its cycles over the test.

use nalgebra::DMatrix;

use super::indicators::{ALL, Indicators};
use super::{Linearised, rounded};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Parameter, Shape};

/// See the head of the file. Variants: the indicators.
pub(super) struct AmbientCycle(pub Indicators);

/// Cycles between neighbouring starts of the search.
const STRIDE: f64 = 0.3;

/// Cycles by which a period must be longer than two traces: at that itself it is a form.
const APART: f64 = 0.1;

impl Effect<Linearised> for AmbientCycle {
    fn name(&self) -> &str {
        "ambient-cycle"
    }

    fn about(&self) -> About {
        About {
            physics: "the temperature of the room swings periodically, and machine and mounts of the indicators follow it",
            confirm: "record the air temperature during a test and compare its period",
            source: "first harmonic of a periodic response; environmental temperature variation error, ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.0.rotations(ALL, 500.0)
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        self.0.rotations(shape.variant, 500.0)
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("cycles", "1", 0.5, 1e6)]
    }

    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let count = ((self.most(model) - 1.0) / STRIDE).floor() as usize;
        let at = |k: usize| Shape {
            variant: self.0.fullest(),
            values: vec![1.0 + STRIDE * k as f64],
            steps: vec![0.5 * STRIDE],
        };
        (0..=count).map(at).collect()
    }

    fn relatives(&self, _model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let other = |variant| Shape {
            variant,
            ..shape.clone()
        };
        self.0.others(shape.variant).map(other).collect()
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let cycles = shape.values.first().copied().unwrap_or(1.0);
        let turn = std::f64::consts::TAU * cycles / model.duration();
        let wave = |function: fn(f64) -> f64| {
            let whole = Column::from_places(model.places(), |_, p| function(turn * p.time));
            self.0.apart(model, shape.variant, &whole)
        };
        let pairs = wave(f64::cos).into_iter().zip(wave(f64::sin));
        pairs.flat_map(|(cosine, sine)| [cosine, sine]).collect()
    }

    fn allowed(&self, model: &Linearised, shape: &Shape) -> bool {
        let reach = 0.9..=self.most(model);
        shape
            .values
            .first()
            .is_some_and(|cycles| reach.contains(cycles))
    }

    /// The cycles are those of the whole test.
    fn carried(
        &self,
        from: &Linearised,
        to: &Linearised,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let longer = to.duration() / from.duration();
        let carried = Shape {
            values: shape.values.iter().map(|cycles| cycles * longer).collect(),
            ..shape.clone()
        };
        (carried, amplitudes.to_vec())
    }

    fn variant_name(&self, model: &Linearised, shape: &Shape) -> Option<String> {
        let cycles = shape.values.first()?;
        Some(format!("period {} s", rounded(model.duration() / cycles)))
    }

    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        self.0.rotating(
            shape.variant,
            shape,
            amplitudes,
            covariance,
            &self.shape_parameters(),
        )
    }
}

impl AmbientCycle {
    /// Most cycles: short of one in the time of two traces, where a sinusoid is the position that goes
    /// forward and back.
    fn most(&self, model: &Linearised) -> f64 {
        let passes = model.traces().len() / self.0.count();
        (0.5 * passes as f64 - APART).max(1.0)
    }
}
