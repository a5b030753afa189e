//! The simultaneous solution against known truth, against the staged solution, and against itself.

mod bands;
mod effects;
mod few_positions;
mod minimum;
mod noise;
mod one_pass;
mod own_positions;
mod plan;
mod refusals;
mod rounded;
mod together;
mod uncertainty;
mod zeroed;
