//! The simultaneous solution against known truth, against the staged solution, and against itself.

mod effects;
#[path = "../faulty_machine/mod.rs"]
mod faulty_machine;
mod minimum;
mod noise;
mod plan;
mod refusals;
mod uncertainty;
