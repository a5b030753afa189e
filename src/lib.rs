//! errsep separates a machine tool's own geometric errors from those of the artefact, the sensors
//! and the set-up.

pub mod cli;
pub mod export;
pub mod io;
pub mod report;

pub use errsep_diagnosis as diagnosis;
pub use errsep_models::number;
