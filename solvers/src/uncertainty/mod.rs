//! Uncertainty where the covariance is not enough.
//!
//! [`profile`] follows the cost itself and is right where curvature makes an interval lopsided;
//! `bootstrap` (a feature) asks nothing of the distribution of the errors but that they are alike.

#[cfg(feature = "bootstrap")]
pub mod bootstrap;
pub mod profile;
mod student;

pub use student::student_quantile;
