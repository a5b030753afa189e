//! The reversal, staged and simultaneous, against known truth.

mod any_model;
mod designs;
mod diagnosable;
#[path = "../faulty_machine/mod.rs"]
mod faulty_machine;
mod left_out;
mod simultaneous;
mod staged;
mod turning;
mod turning_bar;
mod turning_possible;
