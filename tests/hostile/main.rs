//! What goes wrong at the keyboard: bad files, cut-off runs, folders in use.

mod bad_input;
mod bad_setup;
#[path = "../command/mod.rs"]
mod command;
mod hostile_text;
#[cfg(unix)]
mod inputs;
#[cfg(target_os = "linux")]
mod killed;
mod mutated_files;
mod not_solved;
mod out_folder;
mod refusal;
mod refused_figures;
mod units;
