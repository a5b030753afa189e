//! What the regression of step-diagonal readings leaves out: one file an effect.

mod angular_error;
mod dead_path;
mod drift;
mod mirror_misalignment;

use super::diagnosable::DiagonalRuns;
use crate::model::Effect;

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<DiagonalRuns>>> {
    vec![
        Box::new(angular_error::AngularError),
        Box::new(dead_path::DeadPath),
        Box::new(drift::Drift),
        Box::new(mirror_misalignment::MirrorMisalignment),
    ]
}
