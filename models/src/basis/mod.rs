//! Functions in which forms are expanded.

pub mod bspline;
