//! `errsep batch`: many campaigns from one list, on all cores, continued where it was cut off.

mod campaigns;
mod key;
mod log;
mod page;
mod parts;
mod row;
mod work;

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::io::{Message, Status};
use campaigns::Campaigns;
use log::Log;
use parts::Part;

/// Many campaigns from one list: the answers row by row, failures among them, resumed after a stop.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The list has a row a campaign; paths are relative to its folder, options as on the command line:

    id,command,data,setup,options
    m1-monday,reversal,m1/monday.csv,m1/setup.toml,--simultaneous
    m1-gap,diagnose,m1/monday.csv,m1/setup.toml,

DIR gets part-<shard>-<k>.ndjson, one JSON object a campaign in the order of the list, log.ndjson and
index.html. Killed anywhere and run again, it goes on: what is done is skipped as long as data, set-up,
options and version are the same.

Example: errsep batch campaigns.csv --out answers")]
pub struct Args {
    /// The list of campaigns.
    #[arg(value_name = "CAMPAIGNS.csv")]
    list: PathBuf,
    /// Folder of the answers.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Campaigns at the same time; by default as many as there are cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Only every n-th campaign, from the i-th on: for n machines that share DIR.
    #[arg(long, value_name = "i/n", value_parser = shard)]
    shard: Option<Shard>,
    /// Try again what failed.
    #[arg(long)]
    retry_failed: bool,
    /// Read every input again in place of trusting its size and time of change.
    #[arg(long)]
    verify: bool,
    /// Print nothing but errors.
    #[arg(long, short)]
    quiet: bool,
}

/// Which share of the campaigns a run takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shard {
    /// From 1 to `of`.
    index: usize,
    of: usize,
}

fn shard(text: &str) -> Result<Shard, String> {
    let parts = text.split_once('/');
    let numbers = parts.and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match numbers {
        Some((index, of)) if 1 <= index && index <= of => Ok(Shard { index, of }),
        _ => Err("write i/n with i from 1 to n, such as 2/8".to_owned()),
    }
}

/// What a run came to.
#[derive(Debug, Default, Clone, Copy)]
struct Outcome {
    campaigns: usize,
    worked_out: usize,
    failed: usize,
}

/// Works out what is not done yet.
///
/// # Errors
/// The list is wrong, or the folder cannot be written. A campaign that fails is a row, no error.
pub fn run(args: &Args) -> Result<Status, Message> {
    let shard = args.shard.unwrap_or(Shard { index: 1, of: 1 });
    let campaigns = Campaigns::read(&args.list)?;
    std::fs::create_dir_all(&args.out).map_err(|e| unwritable(&args.out, &e))?;
    let _alone = alone(&args.out, shard)?;
    let mut log = Log::open(&args.out, args.verify)?;
    let parts = Part::of(&campaigns, shard, &args.out);
    Part::clear(&parts, shard, &args.out)?;
    let total = parts.iter().map(|part| part.campaigns.len() as u64).sum();
    let bar = if args.quiet {
        indicatif::ProgressBar::hidden()
    } else {
        super::progress("campaigns", Some(total))
    };
    let mut outcome = Outcome::default();
    for part in &parts {
        let done = part.work(&mut log, args, &bar)?;
        outcome.campaigns += part.campaigns.len();
        outcome.worked_out += done.worked_out;
        outcome.failed += done.failed;
    }
    bar.finish_and_clear();
    let page = args.out.join("index.html");
    if outcome.worked_out > 0 || !page.exists() {
        let html = page::of(&args.list, &args.out)?;
        parts::replace(&page, html.as_bytes())?;
    }
    if !args.quiet {
        super::answer::print(&outcome.told(args))?;
    }
    Ok(Status::Done)
}

impl Outcome {
    fn told(&self, args: &Args) -> String {
        let Self {
            campaigns,
            worked_out,
            failed,
        } = *self;
        let mut text = format!(
            "{campaigns} campaign{}: {worked_out} worked out now, {} done before; {} failed\n",
            if campaigns == 1 { "" } else { "s" },
            campaigns - worked_out,
            if failed == 0 {
                "none".to_owned()
            } else {
                failed.to_string()
            },
        );
        if failed > 0 {
            text += "Their rows say why; --retry-failed tries them again.\n";
        }
        text += &format!(
            "\nWritten to {}: part-*.ndjson, log.ndjson, index.html\n",
            args.out.display()
        );
        text
    }
}

/// The lock of a shard in a folder, held until it is dropped.
fn alone(folder: &Path, shard: Shard) -> Result<File, Message> {
    let place = folder.join(format!(".lock-{}-of-{}", shard.index, shard.of));
    let file = File::create(&place).map_err(|e| unwritable(&place, &e))?;
    file.try_lock().map_err(|_| {
        Message::bad_input("another run works on the same campaigns in this folder")
            .in_file(folder)
            .remedy("wait for it, or give another folder or --shard")
    })?;
    Ok(file)
}

fn unwritable(place: &Path, error: &std::io::Error) -> Message {
    Message::bad_input(format!("cannot be written: {error}"))
        .in_file(place)
        .remedy("give a folder that you may write to")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_is_a_share() {
        assert_eq!(shard("2/8"), Ok(Shard { index: 2, of: 8 }));
        for wrong in ["0/3", "4/3", "1", "a/b", "1/0", "-1/2"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
    }
}
