//! The characteristic of one probe is bent.

use super::FourierScans;
use super::gain::{probes, reading};
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// Rounds in which what a bent probe sees is found from what it reads.
const ROUNDS: usize = 4;

/// See the head of the file.
pub(super) struct Nonlinearity;

impl Effect<FourierScans> for Nonlinearity {
    fn name(&self) -> &str {
        "nonlinearity"
    }

    fn about(&self) -> About {
        About {
            physics: "the reading of one probe bends over its range: a probe far from the middle of it",
            confirm: "calibrate the probe over its range, or repeat nearer to its middle",
            source: "the square of the reading about the probe's zero, as great as told at its greatest reading",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("at-reach", "um", 1e3)]
    }

    fn grid(&self, model: &FourierScans) -> Vec<Shape> {
        probes(model)
    }

    fn variant_name(&self, _model: &FourierScans, shape: &Shape) -> Option<String> {
        Some(format!("probe {}", shape.variant))
    }

    fn columns(&self, model: &FourierScans, shape: &Shape) -> Vec<Column> {
        let sign = if shape.variant == 1 { 1.0 } else { -1.0 };
        let read = (0..model.places().len()).map(|row| sign * reading(model, row, shape.variant));
        let read: Vec<f64> = read.collect();
        let bend = shape.values.first().copied().unwrap_or(0.0);
        // The mean of both probes holds half of what the bend makes of the one.
        let mut seen = read.clone();
        for _ in 0..ROUNDS {
            let greatest = reach(&seen);
            for (seen, read) in seen.iter_mut().zip(&read) {
                *seen = read - 0.5 * bend * (*seen / greatest).powi(2);
            }
        }
        let greatest = reach(&seen);
        vec![Column::from_places(model.places(), |row, _| {
            sign * (seen[row] / greatest).powi(2)
        })]
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        shape.settled_at(amplitudes)
    }
}

/// The greatest of some readings.
fn reach(readings: &[f64]) -> f64 {
    let sizes = readings.iter().map(|r| r.abs());
    sizes.fold(f64::MIN_POSITIVE, f64::max)
}
