//! The diagnosis, on data whose cause is known and withheld.

mod agreement;
#[path = "../command/mod.rs"]
mod command;
mod curved;
mod designs;
mod different_grids;
mod drifts;
mod effect_signatures;
mod far_shifts;
mod heights;
mod invariance;
mod laws;
mod models;
mod noise;
#[path = "../other_models/mod.rs"]
mod other_models;
mod pairs;
#[path = "../plate/mod.rs"]
mod plate;
mod plates;
mod pontius;
mod positions;
#[path = "../realisations/mod.rs"]
mod realisations;
mod rough_forms;
#[path = "../scene/mod.rs"]
mod scene;
#[path = "../sealed_machine/mod.rs"]
mod sealed_machine;
mod sealing;
mod several_ways;
mod severity;
mod single_effects;
mod sizes;
mod together;
