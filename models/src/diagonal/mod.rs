//! Diagonal and step-diagonal displacement tests (ISO 230-6) on a machine whose X carries Y carries Z
//! carries the tool.
//!
//! J. A. Soons, *Analysis of the step-diagonal test* (NIST): the kinematic model (1), the measurement
//! equation (4) for a mirror or a retro-reflector on the tool, and the estimators (5) to (46) with
//! their misprints corrected. Beside them the simultaneous regression of everything that a set of
//! readings determines, with what it leaves open said in words.
//!
//! Positions are in mm from corner A of the work zone, readings and translations in µm, angles in rad.

mod answers;
mod closed_forms;
mod components;
mod design;
mod determination;
mod diagnosable;
mod diagonals;
mod effects;
mod elimination;
#[cfg(test)]
mod equal_to_dense;
mod errors;
mod estimates;
mod estimators;
mod geometry;
mod groups;
mod half_covariance;
mod plan;
mod prediction;
mod quantities;
mod readings;
mod regression;
mod runs;
mod simulate;
mod solution;
mod undetermined;

pub use closed_forms::{ClosedForm, DiagonalTotals, Total, TotalsEstimate, closed_forms, totals};
pub use components::{Axis, Component, Location, NodeKind};
pub use design::{Identifiability, identifiability};
pub use determination::{Ambiguity, Determined, Remedy};
pub use diagnosable::DiagonalRuns;
pub use diagonals::{Diagonal, Sequence, Target, Travel, WorkZone};
pub use effects::amplitude;
pub use errors::ErrorTables;
pub use estimates::{
    Assumptions, ComponentEstimate, LocationEstimate, Measured, MirrorEstimate, StepDiagonalFit,
};
pub use estimators::{ESTIMATORS, Estimator};
pub use geometry::exact_reading;
pub use plan::{SequenceChoice, choose_sequences, determined_by};
pub use prediction::{Parameter, Unknowns, predicted_reading};
pub use readings::{DiagonalError, DiagonalReading, Edges, Motion, check};
pub use regression::regress;
pub use simulate::{DiagonalSimulation, Disturbance, Misalignments, simulate, simulate_disturbed};
