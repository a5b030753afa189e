//! What a fixed machine model leaves out of the parts made on it: one file an effect.

mod along_axes;
mod angular_error_times_height;
mod axis_scale;
mod bad_part;
mod datum_offset;
mod datum_rotation;
mod part_rotation;
mod part_temperature;
mod part_zero;
mod positioning;
mod scale_by_axis;
mod squareness_change;
mod straightness;
mod thermal_expansion;

use nalgebra::DMatrix;

use super::MeasuredParts;
use crate::model::{Effect, Estimate, Parameter};

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<MeasuredParts>>> {
    vec![
        Box::new(angular_error_times_height::AngularErrorTimesHeight),
        Box::new(axis_scale::AxisScale),
        Box::new(bad_part::BadPart),
        Box::new(datum_offset::DatumOffset),
        Box::new(datum_rotation::DatumRotation),
        Box::new(part_rotation::PartRotation),
        Box::new(part_temperature::PartTemperature),
        Box::new(part_zero::PartZero),
        Box::new(squareness_change::SquarenessChange),
        Box::new(thermal_expansion::ThermalExpansion),
    ]
}

/// The catalogue of parts whose zeros and turns belong to the model: the errors of the machine that a plate
/// shows in a frame of its own.
pub(super) fn of_aligned_parts() -> Vec<Box<dyn Effect<MeasuredParts>>> {
    vec![
        Box::new(angular_error_times_height::AngularErrorTimesHeight),
        Box::new(bad_part::BadPart),
        Box::new(part_temperature::PartTemperature),
        Box::new(positioning::Positioning),
        Box::new(scale_by_axis::ScaleByAxis),
        Box::new(squareness_change::SquarenessChange),
        Box::new(straightness::Straightness),
        Box::new(thermal_expansion::ThermalExpansion),
    ]
}

/// What the size of an effect on parts is: its first amplitude. `None` where the catalogue has no such effect.
pub fn amplitude(effect: &str) -> Option<Parameter> {
    crate::model::amplitude(&all(), effect)
}

/// Root mean square of every `step`-th amplitude from `first` on, with its standard uncertainty.
fn spread(
    name: &str,
    unit: &str,
    amplitudes: &[f64],
    covariance: &DMatrix<f64>,
    first: usize,
    step: usize,
) -> Estimate {
    let own: Vec<usize> = (first..amplitudes.len()).step_by(step).collect();
    let count = own.len().max(1) as f64;
    let rms = (own.iter().map(|k| amplitudes[*k].powi(2)).sum::<f64>() / count).sqrt();
    let mut variance = 0.0;
    for &i in &own {
        for &j in &own {
            let covaries = covariance.get((i, j)).map_or(f64::NAN, |v| *v);
            variance += amplitudes[i] * amplitudes[j] * covaries;
        }
    }
    Estimate {
        name: name.to_owned(),
        value: rms,
        std: variance.max(0.0).sqrt() / (count * rms).max(f64::MIN_POSITIVE),
        unit: unit.to_owned(),
    }
}
