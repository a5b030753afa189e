//! Nonlinear least squares on a band with a border, from rows that are made, used and forgotten.
//!
//! A model with many local unknowns (coefficients of splines, ordered along an axis) and a few
//! global ones implements [`StructuredProblem`]: it hands out its rows in small batches, and
//! [`minimise`] finds the least-squares solution by Gauss–Newton steps, damped after Levenberg and
//! Marquardt where a step fails, at a cost linear in rows and in unknowns. Batches are factorised
//! on all cores and folded in a fixed order: the result is the same bit for bit whatever the
//! number of threads.

mod evaluate;
mod executor;
mod gathered;
mod minimise;
mod problem;
mod progress;
mod sink;

pub use evaluate::{Evaluation, evaluate, hat_traces};
pub use executor::{StructuredSolver, StructuredState};
pub use minimise::{Fit, Minimiser, minimise};
pub use problem::{Parameters, StructuredProblem};
pub use progress::{Iteration, Options, Parts, Progress};
pub use sink::Sink;
