//! What the first-order reversal model leaves out: one file an effect.
//!
//! To add an effect, write its file and add it to [`all`]; the tests that inject every effect
//! blind find it there.

mod ambient_cycle;
mod axis_backlash;
mod common_gain;
mod cyclic_error;
mod gain_mismatch;
mod gravity_sag;
mod hysteresis;
mod indexing_error;
mod indicator_nonlinearity;
mod indicators;
mod lateral_backlash;
mod local_contamination;
mod off_crest;
mod reversal_shift;
mod stick_slip;
mod taper;
mod thermal_drift;
mod thickness_shift;
mod tip_radius;
mod zero_jump;

use nalgebra::DMatrix;

use super::diagnosable::FirstOrder;
use super::simultaneous;
use crate::model::{Effect, Estimate, Parameter, Shape};

/// The catalogue.
pub fn all() -> Vec<Box<dyn Effect<FirstOrder>>> {
    vec![
        Box::new(ambient_cycle::AmbientCycle),
        Box::new(axis_backlash::AxisBacklash),
        Box::new(common_gain::CommonGain),
        Box::new(cyclic_error::CyclicError),
        Box::new(gain_mismatch::GainMismatch),
        Box::new(gravity_sag::GravitySag),
        Box::new(hysteresis::Hysteresis),
        Box::new(indexing_error::IndexingError),
        Box::new(indicator_nonlinearity::IndicatorNonlinearity),
        Box::new(lateral_backlash::LateralBacklash),
        Box::new(local_contamination::LocalContamination),
        Box::new(off_crest::OffCrest),
        Box::new(reversal_shift::ReversalShift),
        Box::new(stick_slip::StickSlip),
        Box::new(taper::Taper),
        Box::new(thermal_drift::ThermalDrift),
        Box::new(thickness_shift::ThicknessShift),
        Box::new(tip_radius::TipRadius),
        Box::new(zero_jump::ZeroJump),
    ]
}

/// Whether `simultaneous::effects` has an effect too, in the variant that a diagnosis tells in words: a
/// lost motion that grows along the screw, lines of the slide with forms of their own and curves of two
/// powers are diagnosed, but are no unknowns of the fit.
pub fn joins_the_fit(effect: &str, variant: Option<&str>) -> bool {
    const APART: [&str; 4] = [
        axis_backlash::GROWS,
        indicator_nonlinearity::MIXED,
        lateral_backlash::LEANS,
        lateral_backlash::OWN_FORMS,
    ];
    let known = simultaneous::effects::CATALOGUE.iter();
    known.into_iter().any(|entry| entry.name == effect)
        && !variant.is_some_and(|words| APART.iter().any(|apart| words.starts_with(apart)))
}

/// The start of an effect whose signature depends on its own size: infinitely small.
const SETTLING: Shape = Shape {
    variant: 0,
    values: Vec::new(),
    steps: Vec::new(),
};

/// A settling shape at the size that was found.
fn settled_at(shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
    amplitudes.first().map(|&size| Shape {
        values: vec![size],
        steps: vec![0.0],
        ..shape.clone()
    })
}

/// A position as a part of the travel, −1 to 1.
fn part_of_travel(model: &FirstOrder, x: f64) -> f64 {
    let first = model.positions().first().copied().unwrap_or(0.0);
    2.0 * (x - first) / model.travel() - 1.0
}

/// Standard uncertainty of a weighted sum of parameters.
fn spread(covariance: &DMatrix<f64>, weights: &[(usize, f64)]) -> f64 {
    let at = |i: usize, j: usize| covariance.get((i, j)).map_or(f64::NAN, |v| *v);
    let terms = weights
        .iter()
        .flat_map(|(i, w)| weights.iter().map(move |(j, v)| w * v * at(*i, *j)));
    terms.sum::<f64>().clamp(0.0, f64::INFINITY).sqrt()
}

/// The amplitudes of waves: a cosine and a sine for one indicator, or for each.
fn rotations(waves: usize, reach: f64) -> Vec<Parameter> {
    let names: &[&'static str] = if waves == 1 {
        &["cosine", "sine"]
    } else {
        &["near-cosine", "near-sine", "far-cosine", "far-sine"]
    };
    let part = |name: &&'static str| Parameter::symmetric(name, "um", reach);
    names.iter().map(part).collect()
}

/// What is told of waves: the amplitude of each, then the parameters of their shape.
fn rotating(
    waves: usize,
    shape: &Shape,
    amplitudes: &[f64],
    covariance: &DMatrix<f64>,
    parameters: &[Parameter],
) -> Vec<Estimate> {
    let names: &[&str] = if waves == 1 {
        &["amplitude"]
    } else {
        &["near-amplitude", "far-amplitude"]
    };
    let pairs = amplitudes.chunks_exact(2).enumerate();
    let mut told: Vec<Estimate> = pairs
        .zip(names)
        .map(|((k, pair), name)| {
            let size = pair[0].hypot(pair[1]).max(f64::MIN_POSITIVE);
            let along = [(2 * k, pair[0] / size), (2 * k + 1, pair[1] / size)];
            Estimate {
                name: (*name).to_owned(),
                value: size,
                std: spread(covariance, &along),
                unit: "um".to_owned(),
            }
        })
        .collect();
    let shapes = shape.values.iter().zip(parameters).enumerate();
    told.extend(shapes.map(|(k, (value, parameter))| Estimate {
        name: parameter.name.to_owned(),
        value: *value,
        std: spread(covariance, &[(amplitudes.len() + k, 1.0)]),
        unit: parameter.unit.to_owned(),
    }));
    told
}
