//! The command line.

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    errsep::cli::Cli::parse().execute()
}
