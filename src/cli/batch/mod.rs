//! `errsep batch`: many campaigns from one list, on all cores, continued where it was cut off.

mod campaigns;
mod key;
mod lean;
mod log;
mod page;
#[cfg(feature = "parquet")]
mod parquet;
mod parts;
mod row;
mod selection;
pub mod shared;
mod work;

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::io::{Message, Status};
use campaigns::Campaigns;
use log::{Log, Report};
use parts::{How, Part};

/// Many campaigns from one list: the answers row by row, failures among them, resumed after a stop.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The list has a row a campaign; paths are relative to its folder, options as on the command line:

    id,command,data,setup,options
    m1-monday,reversal,m1/monday.csv,m1/setup.toml,--simultaneous
    m1-gap,diagnose,m1/monday.csv,m1/setup.toml,

DIR gets part-<shard>-<k>.ndjson, one JSON object a campaign in the order of the list, log.ndjson and
index.html; with --parquet also part-<shard>-<k>.parquet. Killed anywhere and run again, it goes on: what is done is skipped as long as data, set-up,
options and version are the same.

Example: errsep batch campaigns.csv --out answers")]
pub struct Args {
    /// The list of campaigns.
    #[arg(value_name = "CAMPAIGNS.csv")]
    list: PathBuf,
    /// Folder of the answers.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Campaigns at the same time; by default as many as there are cores, at most sixteen a core.
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
    /// Write every part as Parquet too, with a column for every number of the answers.
    #[arg(long)]
    parquet: bool,
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

/// Campaigns at the same time: as many as there are cores, or what is asked for, at most sixteen a core.
fn at_once(jobs: Option<usize>) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    jobs.map_or(cores, |jobs| jobs.clamp(1, 16 * cores))
}

/// Works out what is not done yet.
///
/// # Errors
/// The list is wrong, or the folder cannot be written. A campaign that fails is a row, no error.
pub fn run(args: &Args) -> Result<Status, Message> {
    let how = How {
        out: args.out.clone(),
        jobs: at_once(args.jobs.map(usize::from)),
        retry_failed: args.retry_failed,
        verify: args.verify,
        parquet: args.parquet,
    };
    let shard = args.shard.unwrap_or(Shard { index: 1, of: 1 });
    let mut batch = Batch::open(&args.list, how, shard)?;
    let bar = if args.quiet {
        indicatif::ProgressBar::hidden()
    } else {
        super::progress("campaigns", Some(batch.outcome.campaigns as u64))
    };
    bar.inc(batch.done_before() as u64);
    for part in std::mem::take(&mut batch.waiting) {
        let report = part.work(&batch.log.inputs, &batch.how, &bar)?;
        batch.take(report)?;
    }
    bar.finish_and_clear();
    let outcome = batch.finish()?;
    if !args.quiet {
        super::answer::print(&outcome.told(args))?;
    }
    Ok(Status::Done)
}

/// A batch: its list is read, its folder locked, and what is done already is known.
struct Batch {
    list: PathBuf,
    how: How,
    log: Log,
    /// The parts that are not complete.
    waiting: Vec<Part>,
    outcome: Outcome,
    _alone: File,
}

impl Batch {
    /// Reads the list and the log.
    ///
    /// # Errors
    /// The list is wrong, or the folder cannot be written.
    fn open(list: &Path, how: How, shard: Shard) -> Result<Self, Message> {
        if how.parquet && !cfg!(feature = "parquet") {
            return Err(
                Message::bad_input("this errsep was built without Parquet").remedy(
                    "leave --parquet out, the .ndjson parts hold the same; or build errsep with it: \
                     cargo install --path . --features parquet",
                ),
            );
        }
        let parts = Part::of(Campaigns::read(list)?, shard);
        std::fs::create_dir_all(&how.out).map_err(|e| unwritable(&how.out, &e))?;
        let alone = alone(&how.out, shard)?;
        let log = Log::open(&how.out, how.verify)?;
        Part::clear(&parts, shard, &how.out)?;
        let mut outcome = Outcome::default();
        let mut waiting = Vec::new();
        for part in parts {
            outcome.campaigns += part.campaigns.len();
            match part.complete(&log, &how) {
                Some(done) if !(how.retry_failed && done.failed > 0) => {
                    outcome.failed += done.failed;
                }
                _ => waiting.push(part),
            }
        }
        Ok(Self {
            list: list.to_owned(),
            how,
            log,
            waiting,
            outcome,
            _alone: alone,
        })
    }

    /// Campaigns of the parts that are complete.
    fn done_before(&self) -> usize {
        let waiting: usize = self.waiting.iter().map(|part| part.campaigns.len()).sum();
        self.outcome.campaigns - waiting
    }

    /// Takes a part that has been put in place.
    ///
    /// # Errors
    /// The log cannot be written.
    fn take(&mut self, report: Report) -> Result<(), Message> {
        self.outcome.worked_out += report.seconds.len();
        self.outcome.failed += report.part.failed;
        self.log.tell(report)
    }

    /// Writes the page.
    ///
    /// # Errors
    /// The folder cannot be read or written.
    fn finish(self) -> Result<Outcome, Message> {
        let page = self.how.out.join("index.html");
        if self.outcome.worked_out > 0 || !page.exists() {
            let html = page::of(&self.list, &self.how.out)?;
            parts::replace(&page, html.as_bytes())?;
        }
        Ok(self.outcome)
    }
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
            "\nWritten to {}: part-*.ndjson,{} log.ndjson, index.html\n",
            args.out.display(),
            if args.parquet { " part-*.parquet," } else { "" }
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
