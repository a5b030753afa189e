//! Nonlinear least squares: one loop, several ways to choose a step.
//!
//! [`minimiser`] holds the loop as an argmin `Solver`; a [`strategy`] proposes steps and is told
//! what became of them; a [`system`] is evaluated and linearised. Any strategy minimises any
//! system.

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
