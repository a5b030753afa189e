//! The simultaneous solution against known truth, against the staged solution, and against itself.

mod minimum;
mod noise;
mod plan;
mod refusals;
mod uncertainty;
