//! `errsep completions`: what a shell needs to complete the command line.

use clap::CommandFactory;
use clap_complete::Shell;

use super::{Cli, answer};
use crate::io::{Message, Status};

/// Completions of the command line for a shell, on standard output.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example, for bash:  errsep completions bash > ~/.local/share/bash-completion/completions/errsep")]
pub struct Args {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints the completions.
///
/// # Errors
/// They cannot be printed.
pub fn run(args: &Args) -> Result<Status, Message> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "errsep", &mut script);
    answer::print(&String::from_utf8_lossy(&script))?;
    Ok(Status::Done)
}
