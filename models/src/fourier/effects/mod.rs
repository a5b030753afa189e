//! What the Fourier separation leaves out: one file an effect.

mod height_difference;
mod probe_spacing;
mod yaw;

use super::diagnosable::FourierScans;
use crate::model::Effect;

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<FourierScans>>> {
    vec![
        Box::new(height_difference::HeightDifference),
        Box::new(probe_spacing::ProbeSpacing),
        Box::new(yaw::Yaw),
    ]
}
