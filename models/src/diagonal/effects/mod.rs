//! What the regression of step-diagonal readings leaves out: one file an effect.

mod angular_error;
mod axis_growth;
mod dead_path;
mod drift;
mod lost_counts;
mod mirror_creep;
mod mirror_misalignment;
mod thermal_expansion;

use super::diagnosable::DiagonalRuns;
use crate::model::{Effect, Parameter};

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<DiagonalRuns>>> {
    vec![
        Box::new(angular_error::AngularError),
        Box::new(axis_growth::AxisGrowth),
        Box::new(dead_path::DeadPath),
        Box::new(drift::Drift),
        Box::new(lost_counts::LostCounts),
        Box::new(mirror_creep::MirrorCreep),
        Box::new(mirror_misalignment::MirrorMisalignment),
        Box::new(thermal_expansion::ThermalExpansion),
    ]
}

/// What the size of an effect on readings along diagonals is: its first amplitude. `None` where the catalogue has no such
/// effect.
pub fn amplitude(effect: &str) -> Option<Parameter> {
    crate::model::amplitude(&all(), effect)
}
