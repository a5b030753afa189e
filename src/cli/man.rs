//! `errsep man`: the manual pages.

use std::path::PathBuf;

use clap::CommandFactory;

use super::{Cli, answer};
use crate::io::{Message, Status};

/// Manual pages of errsep and of every command, written into a folder.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Pages of an earlier version in the folder are replaced.

Example: errsep man man1, then man ./man1/errsep-reversal.1")]
pub struct Args {
    /// The folder; it is made where it is not there.
    #[arg(value_name = "DIR")]
    place: PathBuf,
}

/// Writes the pages.
///
/// # Errors
/// The folder cannot be written.
pub fn run(args: &Args) -> Result<Status, Message> {
    std::fs::create_dir_all(&args.place)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), &args.place))
        .map_err(|e| {
            Message::bad_input(format!("the manual pages cannot be written: {e}"))
                .in_file(&args.place)
                .remedy("name a folder that you may write to")
        })?;
    answer::print(&format!(
        "Manual pages written to {}\n",
        args.place.display()
    ))?;
    Ok(Status::Done)
}
