//! The command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(errsep::cli::run(std::env::args_os().collect()))
}
