//! What the first-order reversal model leaves out: one file an effect.
//!
//! To add an effect, write its file and add it to [`all`]; the tests that inject every effect
//! blind find it there.

mod axis_backlash;
mod common_gain;
mod cyclic_error;
mod gain_mismatch;
mod gravity_sag;
mod hysteresis;
mod indicator_nonlinearity;
mod local_contamination;
mod reversal_shift;
mod taper;
mod thermal_drift;
mod thickness_shift;
mod tip_radius;
mod zero_jump;

use super::diagnosable::FirstOrder;
use crate::model::{Effect, Shape};

/// The catalogue.
pub fn all() -> Vec<Box<dyn Effect<FirstOrder>>> {
    vec![
        Box::new(axis_backlash::AxisBacklash),
        Box::new(common_gain::CommonGain),
        Box::new(cyclic_error::CyclicError),
        Box::new(gain_mismatch::GainMismatch),
        Box::new(gravity_sag::GravitySag),
        Box::new(hysteresis::Hysteresis),
        Box::new(indicator_nonlinearity::IndicatorNonlinearity),
        Box::new(local_contamination::LocalContamination),
        Box::new(reversal_shift::ReversalShift),
        Box::new(taper::Taper),
        Box::new(thermal_drift::ThermalDrift),
        Box::new(thickness_shift::ThicknessShift),
        Box::new(tip_radius::TipRadius),
        Box::new(zero_jump::ZeroJump),
    ]
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
