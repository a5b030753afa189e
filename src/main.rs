//! The command line.

use std::process::ExitCode;

use errsep::cli::Cli;

fn main() -> ExitCode {
    match Cli::from_arguments() {
        Ok(command) => command.execute(),
        Err(status) => status,
    }
}
