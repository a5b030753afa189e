//! What the Fourier separation leaves out: one file an effect.

mod beyond_the_section;
mod drift;
mod gain;
mod height_difference;
mod nonlinearity;
mod probe_spacing;
mod thermal_bending;
mod travel_scale;
mod yaw;
mod zero_jump;

use super::diagnosable::FourierScans;
use crate::model::{Effect, Parameter};

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<FourierScans>>> {
    vec![
        Box::new(beyond_the_section::BeyondTheSection),
        Box::new(drift::Drift),
        Box::new(gain::Gain),
        Box::new(height_difference::HeightDifference),
        Box::new(nonlinearity::Nonlinearity),
        Box::new(probe_spacing::ProbeSpacing),
        Box::new(thermal_bending::ThermalBending),
        Box::new(travel_scale::TravelScale),
        Box::new(yaw::Yaw),
        Box::new(zero_jump::ZeroJump),
    ]
}

/// What the size of an effect on scans is: its first amplitude. `None` where the catalogue has no such
/// effect.
pub fn amplitude(effect: &str) -> Option<Parameter> {
    crate::model::amplitude(&all(), effect)
}
