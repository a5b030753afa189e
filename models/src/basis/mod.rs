//! Functions in which forms are expanded.

pub mod bspline;
pub(crate) mod few_waves;
pub(crate) mod interpolant;
