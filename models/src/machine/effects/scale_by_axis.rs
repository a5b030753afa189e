//! Each axis has a scale of its own.

use super::MeasuredParts;
use super::along_axes::is_read;
use crate::machine::Axis;
use crate::model::{About, Column, Effect, Estimate, Parameter, Shape};
use crate::units::um_from_mm;
use nalgebra::DMatrix;

/// See the head of the file.
pub(super) struct ScaleByAxis;

impl ScaleByAxis {
    fn axes(model: &MeasuredParts) -> Vec<Axis> {
        Axis::ALL
            .into_iter()
            .filter(|a| is_read(model, *a))
            .collect()
    }

    /// The axes of each variant: one, or all.
    fn variants(model: &MeasuredParts) -> Vec<Vec<Axis>> {
        let axes = Self::axes(model);
        let mut variants: Vec<Vec<Axis>> = axes.iter().map(|axis| vec![*axis]).collect();
        if axes.len() > 1 {
            variants.push(axes);
        }
        variants
    }
}

impl Effect<MeasuredParts> for ScaleByAxis {
    fn name(&self) -> &str {
        "scale-by-axis"
    }

    fn about(&self) -> About {
        About {
            physics: "the scales of the axes are off, each by its own: a scale that is not compensated, a screw that is warm",
            confirm: "run each axis against a laser or a step gauge, with the temperature of its scale",
            source: "linear terms of EXX, EYY, EZZ; ISO 230-1",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("scale", "1", 1e-3)]
    }

    fn estimates(
        &self,
        _shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let name = |k: usize| match amplitudes.len() {
            1 => "scale".to_owned(),
            _ => format!("scale-{}", ["1", "2", "3"].get(k).unwrap_or(&"")),
        };
        let std = |k: usize| {
            covariance
                .get((k, k))
                .map_or(f64::NAN, |v| v.max(0.0).sqrt())
        };
        let each = amplitudes.iter().enumerate();
        each.map(|(k, value)| Estimate {
            name: name(k),
            value: *value,
            std: std(k),
            unit: "1".to_owned(),
        })
        .collect()
    }

    fn grid(&self, model: &MeasuredParts) -> Vec<Shape> {
        (0..Self::variants(model).len())
            .map(Shape::variant)
            .collect()
    }

    fn variant_name(&self, model: &MeasuredParts, shape: &Shape) -> Option<String> {
        let variants = Self::variants(model);
        let letters: String = variants
            .get(shape.variant)?
            .iter()
            .map(|a| a.letter())
            .collect();
        Some(match letters.len() {
            1 => format!("axis {letters}"),
            _ => format!(
                "axes {}",
                letters
                    .chars()
                    .map(String::from)
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
        })
    }

    fn columns(&self, model: &MeasuredParts, shape: &Shape) -> Vec<Column> {
        let variants = Self::variants(model);
        let axes = variants.get(shape.variant).cloned().unwrap_or_default();
        let of = |axis: Axis| {
            model.column(move |r| match r.axis == axis {
                true => um_from_mm(r.position[axis.index()]),
                false => 0.0,
            })
        };
        axes.into_iter().map(of).collect()
    }
}
