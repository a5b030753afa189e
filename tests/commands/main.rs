//! Every command as a person runs it: answers, figures of papers and certificates, files.

mod anova;
mod batch;
mod called;
mod circle;
mod columns;
#[path = "../command/mod.rs"]
mod command;
mod designs;
mod designs_beside_the_crest;
mod designs_noise_and_tables;
mod diagnose;
mod export;
#[path = "../../models/tests/faulty_machine/mod.rs"]
#[allow(dead_code, reason = "each test file uses its part")]
mod faulty_machine;
mod four_sensor;
mod fourier;
mod law;
mod learn;
mod machine;
mod measured_reversals;
mod packaging;
mod parts_of_nistir;
mod plan;
mod plan_of_designs;
mod plates;
mod plates_named;
mod positioning;
mod report;
mod reversal;
mod seal;
#[path = "../sealed_machine/mod.rs"]
mod sealed_machine;
mod spindle_bar;
mod step_diagonal;
mod turning_bar;
mod with_effects;
mod with_other_models;
