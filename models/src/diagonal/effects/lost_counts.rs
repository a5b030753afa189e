//! The laser loses counts within a run.

use super::DiagonalRuns;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::model::{Moments, Place};

/// Moments of a run at which the search begins.
const MOST: usize = 25;

/// The readings of a run.
fn of_run(model: &DiagonalRuns, run: usize) -> impl Iterator<Item = &Place> {
    let rows = model.traces().get(run).cloned().unwrap_or_default();
    rows.map(|k| &model.places()[k])
}

/// See the head of the file.
pub(super) struct LostCounts;

impl Effect<DiagonalRuns> for LostCounts {
    fn name(&self) -> &str {
        "lost-counts"
    }

    fn about(&self) -> About {
        About {
            physics: "the beam is broken or the axes are too fast for the counter, so that the laser loses counts from one reading on",
            confirm: "look at the signal strength along the run, and repeat it",
            source: "a constant from a moment on until the end of the run; ISO 230-6",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("lost", "um", 1e4)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("time", "readings", 0.0, 1e9)]
    }

    fn grid(&self, model: &DiagonalRuns) -> Vec<Shape> {
        let runs = 0..model.traces().len();
        runs.flat_map(|run| Moments::of(of_run(model, run)).grid(run, MOST))
            .collect()
    }

    fn moments(&self, model: &DiagonalRuns, shape: &Shape) -> Vec<f64> {
        Moments::of(of_run(model, shape.variant)).all()
    }

    fn columns(&self, model: &DiagonalRuns, shape: &Shape) -> Vec<Column> {
        let (Some(&moment), Some(run)) = (shape.values.first(), model.traces().get(shape.variant))
        else {
            return Vec::new();
        };
        let after = |k: &usize| model.places()[*k].time > moment;
        let rows: Vec<usize> = run.clone().filter(after).collect();
        vec![Column {
            values: vec![1.0; rows.len()],
            rows,
        }]
    }

    fn variant_name(&self, model: &DiagonalRuns, shape: &Shape) -> Option<String> {
        let place = &model.places()[model.traces().get(shape.variant)?.start];
        let names = model.channel_names();
        Some(format!(
            "{}, repeat {}",
            names.get(place.channel)?,
            place.repeat
        ))
    }
}
