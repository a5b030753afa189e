//! Nonlinear least squares: one loop, several ways to choose a step.
//!
//! | who | does |
//! |---|---|
//! | [`system`] | is evaluated and linearised; a dense problem, or one that streams its rows and brings cost and linear model in one pass |
//! | [`LinearModel`](crate::linear::LinearModel) | what it makes: steps, damped or not, their promise, what is not determined; keeps constraints and held parameters itself |
//! | [`strategy`] | proposes steps and is told what became of them |
//! | [`minimiser`] | the loop (propose, judge, damp, end), as an argmin `Solver` |
//!
//! Any strategy minimises any system. [`Finish`](crate::options::Finish) says what is done once a
//! minimum shows.

mod at_rest;
mod descend;
pub mod dogleg;
pub mod gauss_newton;
pub mod gauss_newton_first;
mod geodesic;
pub mod levenberg_marquardt;
pub mod minimiser;
mod minimum;
mod polish;
mod rescue;
mod restrict;
mod start;
pub mod strategy;
pub mod system;
pub mod variable_projection;
