//! Nonlinear least squares on a band with a border, from rows that are made, used and forgotten.
//!
//! A model with many local unknowns (coefficients of splines, ordered along an axis) and a few
//! global ones implements [`StructuredProblem`]: it hands out its rows in small batches, and
//! [`fit_structured`] finds the least-squares solution at a cost linear in rows and in unknowns.
//! Batches are factorised on all cores and folded in a fixed order: the result is the same bit for
//! bit whatever the number of threads.
//!
//! The minimiser is that of every fit ([`nonlinear`](crate::nonlinear)), over a
//! [`BorderedModel`](crate::linear::bordered::BorderedModel); a pass over the rows is one evaluation,
//! and the last step is taken on its promise ([`Finish::Promised`](crate::options::Finish)).

mod evaluate;
mod fit;
mod problem;
mod sink;
mod system;

pub use evaluate::{Evaluation, evaluate, hat_traces};
pub use fit::{StructuredExecutor, StructuredFit, fit_structured, fit_structured_with};
pub use problem::{Parameters, StructuredProblem};
pub use sink::Sink;
pub use system::Structured;
