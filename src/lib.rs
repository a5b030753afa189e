//! errsep separates a machine tool's own geometric errors from those of the artefact, the sensors
//! and the set-up.

pub mod cli;
pub mod diagnosis;
pub mod export;
pub mod io;
pub mod number;
pub mod report;
