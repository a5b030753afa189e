//! Part files: so many campaigns each, written whole and put in place in one step.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;
use sha2::{Digest, Sha256};

use super::campaigns::{Campaign, Campaigns};
use super::key::state;
use super::log::{Log, PartDone};
use super::row::{Row, Status};
use super::{Args, Shard, unwritable, work};
use crate::io::Message;
use crate::io::source::hexadecimal;

/// Rows that are there: id and key, line and status.
type Known = HashMap<(String, String), (String, Status)>;

/// Campaigns of one part.
const LENGTH: usize = 200;

/// The campaigns of one part and its place.
pub(super) struct Part<'a> {
    pub campaigns: Vec<&'a Campaign>,
    place: PathBuf,
    /// Rows of a part that is not complete: what a kill leaves to be taken up.
    journal: PathBuf,
}

/// A share in the names of its files.
fn share(shard: Shard) -> String {
    match shard.of {
        1 => "1".to_owned(),
        n => format!("{}of{n}", shard.index),
    }
}

/// The part files of a folder, by name.
///
/// # Errors
/// It cannot be read.
pub(super) fn part_files(folder: &Path) -> Result<Vec<PathBuf>, Message> {
    let entries = std::fs::read_dir(folder).map_err(|e| unreadable(folder, &e))?;
    let mut parts: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    parts.retain(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("part-") && name.ends_with(".ndjson")
    });
    parts.sort();
    Ok(parts)
}

/// What became of a part.
#[derive(Debug, Default)]
pub(super) struct Done {
    pub worked_out: usize,
    pub failed: usize,
}

impl<'a> Part<'a> {
    /// The parts of a shard: campaigns i, i + n, i + 2n …, so that a list may grow at its end.
    pub fn of(campaigns: &'a Campaigns, shard: Shard, folder: &Path) -> Vec<Self> {
        let own: Vec<&Campaign> = campaigns
            .0
            .iter()
            .skip(shard.index - 1)
            .step_by(shard.of)
            .collect();
        let name = share(shard);
        let chunks = own.chunks(LENGTH).enumerate();
        chunks
            .map(|(k, campaigns)| Self {
                campaigns: campaigns.to_vec(),
                place: folder.join(format!("part-{name}-{:05}.ndjson", k + 1)),
                journal: folder.join(format!(".journal-{name}-{:05}.ndjson", k + 1)),
            })
            .collect()
    }

    /// Parts that a folder holds of other shares than these, or of more campaigns than the list has now.
    fn strange(parts: &[Self], shard: Shard, folder: &Path) -> Result<Vec<PathBuf>, Message> {
        let own = format!("part-{}-", share(shard));
        let of = if shard.of == 1 {
            None
        } else {
            Some(format!("of{}-", shard.of))
        };
        let mut left = Vec::new();
        for place in part_files(folder)? {
            let name = place.file_name().unwrap_or_default().to_string_lossy();
            let same = match &of {
                None => !name.contains("of"),
                Some(of) => name.contains(of.as_str()),
            };
            if !same {
                return Err(
                    Message::bad_input("these answers were shared out otherwise")
                        .in_file(&place)
                        .remedy("give --shard with the same number of shares, or another folder"),
                );
            }
            if name.starts_with(&own) && parts.iter().all(|part| part.place != place) {
                left.push(place);
            }
        }
        Ok(left)
    }

    /// Takes away the parts beyond a list that has become shorter.
    ///
    /// # Errors
    /// The folder holds answers that were shared out otherwise, or cannot be written.
    pub fn clear(parts: &[Self], shard: Shard, folder: &Path) -> Result<(), Message> {
        for place in Self::strange(parts, shard, folder)? {
            std::fs::remove_file(&place).map_err(|e| unwritable(&place, &e))?;
        }
        Ok(())
    }

    /// Works out what is not done, and puts the part in place.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn work(&self, log: &mut Log, args: &Args, bar: &ProgressBar) -> Result<Done, Message> {
        let keys: Vec<String> = self.campaigns.iter().map(|c| log.inputs.key(c)).collect();
        let rows = self.digest(&keys);
        if let Some(done) = self.complete(log, &rows)
            && !(args.retry_failed && done.failed > 0)
        {
            bar.inc(self.campaigns.len() as u64);
            return Ok(Done {
                worked_out: 0,
                failed: done.failed,
            });
        }
        let mut known = self.known(args.retry_failed)?;
        let mut lines: Vec<Option<(String, Status)>> = Vec::new();
        let mut waiting = Vec::new();
        for (at, (campaign, key)) in self.campaigns.iter().zip(&keys).enumerate() {
            let line = known.remove(&(campaign.id.clone(), key.clone()));
            if line.is_none() {
                waiting.push((at, *campaign, key.clone()));
            }
            lines.push(line);
        }
        bar.inc((self.campaigns.len() - waiting.len()) as u64);
        let seconds = self.work_out(&waiting, &mut lines, args, bar)?;
        let (mut text, mut failed) = (String::new(), 0);
        for (line, status) in lines.into_iter().flatten() {
            text += &line;
            text.push('\n');
            failed += usize::from(status == Status::Failed);
        }
        replace(&self.place, text.as_bytes())?;
        let (size, changed) = state(&self.place).map_err(|e| unwritable(&self.place, &e))?;
        let part = PartDone {
            part: self.name(),
            size,
            changed,
            rows,
            failed,
        };
        log.tell(part, seconds)?;
        // It is in the part now.
        let _ = std::fs::remove_file(&self.journal);
        Ok(Done {
            worked_out: waiting.len(),
            failed,
        })
    }

    /// Works out campaigns; each row goes to the journal at once. Returns the seconds of each.
    fn work_out(
        &self,
        waiting: &[(usize, &Campaign, String)],
        lines: &mut [Option<(String, Status)>],
        args: &Args,
        bar: &ProgressBar,
    ) -> Result<Vec<(String, f64)>, Message> {
        if waiting.is_empty() {
            return Ok(Vec::new());
        }
        let open = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.journal);
        let mut journal = open.map_err(|e| unwritable(&self.journal, &e))?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let jobs = args.jobs.map_or(cores, usize::from);
        let mut seconds = Vec::new();
        work::all(waiting, jobs, bar, |worked| {
            let failed = |e: std::io::Error| unwritable(&self.journal, &e);
            let line = serde_json::to_string(&worked.row).map_err(|e| failed(e.into()))?;
            // A line that a kill has cut off ends before this one.
            journal
                .write_all(format!("\n{line}\n").as_bytes())
                .map_err(failed)?;
            seconds.push((worked.row.id.clone(), worked.seconds));
            lines[worked.at] = Some((line, worked.row.status));
            Ok(())
        })?;
        Ok(seconds)
    }

    fn name(&self) -> String {
        let name = self.place.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Digest of what the rows are about.
    fn digest(&self, keys: &[String]) -> String {
        let mut hash = Sha256::new();
        for (campaign, key) in self.campaigns.iter().zip(keys) {
            hash.update((campaign.id.len() as u64).to_le_bytes());
            hash.update(&campaign.id);
            hash.update(key);
        }
        hexadecimal(hash)
    }

    /// Whether the part is there with just these rows, as the log has it.
    fn complete<'l>(&self, log: &'l Log, rows: &str) -> Option<&'l PartDone> {
        let done = log.part(&self.name())?;
        let there = state(&self.place).ok()?;
        (done.rows == rows && there == (done.size, done.changed)).then_some(done)
    }

    /// The rows that are there, by id and key: of the part and of its journal.
    fn known(&self, retry_failed: bool) -> Result<Known, Message> {
        let mut known = Known::new();
        for place in [&self.place, &self.journal] {
            for (line, row) in rows_of(place)? {
                if !(retry_failed && row.status == Status::Failed) {
                    known.insert((row.id, row.key), (line, row.status));
                }
            }
        }
        Ok(known)
    }
}

/// The rows of a file that may not be there, with their lines; what is no row, as a kill leaves it, is
/// passed over.
pub(super) fn rows_of(place: &Path) -> Result<Vec<(String, Row)>, Message> {
    let file = match File::open(place) {
        Ok(file) => file,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(unreadable(place, &e)),
    };
    let mut rows = Vec::new();
    for line in BufReader::new(file).split(b'\n') {
        let line = line.map_err(|e| unreadable(place, &e))?;
        if let Ok(text) = String::from_utf8(line)
            && let Ok(row) = serde_json::from_str(&text)
        {
            rows.push((text, row));
        }
    }
    Ok(rows)
}

fn unreadable(place: &Path, error: &std::io::Error) -> Message {
    Message::bad_input(format!("cannot be read: {error}"))
        .in_file(place)
        .remedy("give a folder that you may read and write")
}

/// Puts a file in place in one step, old or new at any moment.
///
/// # Errors
/// It cannot be written.
pub(super) fn replace(place: &Path, content: &[u8]) -> Result<(), Message> {
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    let beside = place.with_file_name(format!(".{name}.new"));
    std::fs::write(&beside, content)
        .and_then(|()| std::fs::rename(&beside, place))
        .map_err(|e| unwritable(place, &e))
}
