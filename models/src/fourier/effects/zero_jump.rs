//! The zero of a probe jumps within a scan.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::model::{Moments, Place};

/// Moments of a scan at which the search begins.
const MOST: usize = 25;

/// The readings of a scan.
fn of_scan(model: &FourierScans, scan: usize) -> impl Iterator<Item = &Place> {
    let rows = model.traces().get(scan).cloned().unwrap_or_default();
    rows.map(|k| &model.places()[k])
}

/// See the head of the file.
pub(super) struct ZeroJump;

impl Effect<FourierScans> for ZeroJump {
    fn name(&self) -> &str {
        "zero-jump"
    }

    fn about(&self) -> About {
        About {
            physics: "the zero of a probe jumps within one scan: a knock, a clamp that slips",
            confirm: "repeat that scan, and read a fixed point before and after it",
            source: "a constant from a moment on until the end of the scan",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("jump", "um", 1e4)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("time", "readings", 0.0, 1e9)]
    }

    fn grid(&self, model: &FourierScans) -> Vec<Shape> {
        let scans = 0..model.traces().len();
        scans
            .flat_map(|scan| Moments::of(of_scan(model, scan)).grid(scan, MOST))
            .collect()
    }

    fn moments(&self, model: &FourierScans, shape: &Shape) -> Vec<f64> {
        Moments::of(of_scan(model, shape.variant)).all()
    }

    fn columns(&self, model: &FourierScans, shape: &Shape) -> Vec<Column> {
        let (Some(&moment), Some(scan)) = (shape.values.first(), model.traces().get(shape.variant))
        else {
            return Vec::new();
        };
        let after = |k: &usize| model.places()[*k].time > moment;
        let rows: Vec<usize> = scan.clone().filter(after).collect();
        vec![Column {
            values: vec![1.0; rows.len()],
            rows,
        }]
    }

    fn variant_name(&self, model: &FourierScans, shape: &Shape) -> Option<String> {
        let place = &model.places()[model.traces().get(shape.variant)?.start];
        let spacing = model.spacings().get(place.channel)?;
        Some(format!("spacing {spacing} mm, repeat {}", place.repeat))
    }
}
