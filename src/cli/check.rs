//! `errsep check`: a measurement against what was sealed before it was made.

use std::path::{Path, PathBuf};

use super::diagnose::sealed::SealFile;
use super::{Answer, CommonArgs, diagnose};
use crate::io::Message;
use crate::io::source::{InMemory, hold, want_digests};

/// Does a measurement show what was sealed before it was made?
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The seal is written by errsep diagnose before the measurement:

    errsep diagnose monday.csv --seal next.toml --next plan.csv
    errsep check next.toml friday.csv --out checked

Exit status 0: it was scored, whatever the score. 2: the seal is broken, or a file is bad.")]
pub struct Args {
    /// What was sealed.
    #[arg(value_name = "SEALED.toml")]
    sealed: PathBuf,
    /// The readings of the measurement.
    #[arg(value_name = "NEW.csv")]
    data: PathBuf,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Scores the readings.
///
/// # Errors
/// The seal is broken, or the readings are bad or not those that were planned.
pub fn run(args: &Args) -> Result<Answer, Message> {
    want_digests();
    let seal = SealFile::read(&args.sealed)?;
    let held = |what: &str, text: &Option<String>| {
        let text = text.as_ref()?;
        let name = format!("{} ({what})", args.sealed.display());
        hold(InMemory {
            name: name.clone(),
            bytes: text.as_bytes().into(),
        });
        Some(PathBuf::from(name))
    };
    let (setup, effects) = (held("set-up", &seal.setup), held("effects", &seal.effects));
    let mut answer = diagnose::scored(&args.data, [setup, effects], seal, &args.common)?;
    answer.inputs.insert(0, Path::to_owned(&args.sealed));
    Ok(answer)
}
