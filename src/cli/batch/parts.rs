//! Part files: so many campaigns each, written whole and put in place in one step.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::campaigns::{Campaign, Campaigns};
use super::key::{Inputs, state};
use super::log::{Log, PartDone, Report};
use super::row::{Head, Status};
use super::{Shard, selection, unwritable, work};
use crate::io::Message;
use crate::io::source::hexadecimal;

/// Rows that are there: id and key, line and status.
type Known = HashMap<(String, String), (String, Status)>;

/// Campaigns of one part.
const LENGTH: usize = 200;

/// The campaigns of one part.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Part {
    pub campaigns: Vec<Campaign>,
    /// Share and number, as its files are called by.
    name: String,
}

/// How parts are worked out.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct How {
    /// The folder of the answers.
    pub out: PathBuf,
    /// Campaigns at the same time.
    pub jobs: usize,
    pub retry_failed: bool,
    /// Whether every input is read again.
    pub verify: bool,
    /// Whether every part is written as Parquet too.
    pub parquet: bool,
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

impl Part {
    /// The parts of a shard: campaigns i, i + n, i + 2n …, so that a list may grow at its end.
    pub fn of(campaigns: Campaigns, shard: Shard) -> Vec<Self> {
        let own = campaigns.0.into_iter().skip(shard.index - 1);
        let mut own = own.step_by(shard.of);
        let share = share(shard);
        let next = |k: usize| {
            let campaigns: Vec<Campaign> = own.by_ref().take(LENGTH).collect();
            (!campaigns.is_empty()).then(|| Self {
                campaigns,
                name: format!("{share}-{k:05}"),
            })
        };
        (1..).map_while(next).collect()
    }

    fn file_name(&self) -> String {
        format!("part-{}.ndjson", self.name)
    }

    /// Its answers.
    fn place(&self, folder: &Path) -> PathBuf {
        folder.join(self.file_name())
    }

    /// The same as Parquet.
    fn parquet(&self, folder: &Path) -> PathBuf {
        self.place(folder).with_extension("parquet")
    }

    /// Rows of a part that is not complete: what a kill leaves to be taken up.
    fn journal(&self, folder: &Path) -> PathBuf {
        folder.join(format!(".journal-{}.ndjson", self.name))
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
            if name.starts_with(&own) && parts.iter().all(|part| part.file_name() != name) {
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
            let parquet = place.with_extension("parquet");
            if parquet.exists() {
                std::fs::remove_file(&parquet).map_err(|e| unwritable(&parquet, &e))?;
            }
            std::fs::remove_file(&place).map_err(|e| unwritable(&place, &e))?;
        }
        Ok(())
    }

    /// What the log says of the part, where it is complete: there as it was written, and about these
    /// campaigns, whose inputs are as they were.
    pub fn complete<'l>(&self, log: &'l Log, how: &How) -> Option<&'l PartDone> {
        let done = log.part(&self.file_name())?;
        let there = state(&self.place(&how.out)).ok()?;
        let lacks = how.parquet && !self.parquet(&how.out).exists();
        if lacks || there != (done.size, done.changed) {
            return None;
        }
        let keys = self.campaigns.iter().map(|c| log.inputs.known_key(c));
        let keys: Vec<String> = keys.collect::<Option<_>>()?;
        (done.rows == self.digest(&keys)).then_some(done)
    }

    /// Works out what is not done, and puts the part in place. Where another process is at the same part,
    /// its end is waited for.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn work(&self, inputs: &Inputs, how: &How, bar: &ProgressBar) -> Result<Report, Message> {
        let (place, journal) = (self.place(&how.out), self.journal(&how.out));
        let open = OpenOptions::new().create(true).append(true).open(&journal);
        let mut kept = open.map_err(|e| unwritable(&journal, &e))?;
        kept.lock().map_err(|e| unwritable(&journal, &e))?;
        let held = selection::read(&self.campaigns);
        let keys = work::keys(&self.campaigns, (inputs, &held), how.jobs)?;
        let mut known = known(&[&place, &journal], how.retry_failed)?;
        let mut lines: Vec<Option<(String, Status)>> = Vec::new();
        let mut waiting = Vec::new();
        for (at, (campaign, key)) in self.campaigns.iter().zip(&keys).enumerate() {
            let line = known.remove(&(campaign.id.clone(), key.clone()));
            if line.is_none() {
                waiting.push((at, campaign, key.clone()));
            }
            lines.push(line);
        }
        bar.inc((self.campaigns.len() - waiting.len()) as u64);
        let mut seconds = Vec::new();
        let mut longest = 0;
        work::all(&waiting, (inputs, &held), how.jobs, bar, |worked| {
            let failed = |e: std::io::Error| unwritable(&journal, &e);
            // A line that a kill has cut off ends before this one.
            let mut line = Vec::with_capacity(longest);
            line.push(b'\n');
            serde_json::to_writer(&mut line, &worked.row).map_err(|e| failed(e.into()))?;
            line.push(b'\n');
            longest = longest.max(line.len());
            kept.write_all(&line).map_err(failed)?;
            let line = String::from_utf8(line).map_err(|e| failed(std::io::Error::other(e)))?;
            seconds.push((worked.row.id.clone(), worked.seconds));
            lines[worked.at] = Some((line, worked.row.status));
            Ok(())
        })?;
        let kept = || lines.iter().flatten();
        let failed = kept()
            .filter(|(_, status)| *status == Status::Failed)
            .count();
        let rows: Vec<&str> = kept().map(|(line, _)| line.trim_matches('\n')).collect();
        self.beside(&rows, how)?;
        replace_by(&place, |file| {
            let mut file = BufWriter::with_capacity(1 << 16, file);
            for row in &rows {
                file.write_all(row.as_bytes())?;
                file.write_all(b"\n")?;
            }
            file.flush()
        })?;
        let (size, changed) = state(&place).map_err(|e| unwritable(&place, &e))?;
        let part = PartDone {
            part: self.file_name(),
            size,
            changed,
            rows: self.digest(&keys),
            failed,
        };
        // It is in the part now.
        let _ = std::fs::remove_file(&journal);
        Ok(Report {
            part,
            seconds,
            inputs: inputs.take_fresh(),
        })
    }

    /// The rows as Parquet, where that is asked for; else what is there of other rows goes.
    fn beside(&self, rows: &[&str], how: &How) -> Result<(), Message> {
        let place = self.parquet(&how.out);
        #[cfg(feature = "parquet")]
        if how.parquet {
            let bytes = super::parquet::of(rows.iter().copied())
                .map_err(|e| unwritable(&place, &std::io::Error::other(e)))?;
            return replace(&place, &bytes);
        }
        let same = || {
            let old = std::fs::read_to_string(self.place(&how.out));
            old.is_ok_and(|old| old.lines().eq(rows.iter().copied()))
        };
        if place.exists() && !same() {
            std::fs::remove_file(&place).map_err(|e| unwritable(&place, &e))?;
        }
        Ok(())
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
}

/// The rows that are there, by id and key.
fn known(places: &[&Path], retry_failed: bool) -> Result<Known, Message> {
    let mut known = Known::new();
    for place in places {
        for (line, row) in rows_of::<Head>(place)? {
            if !(retry_failed && row.status == Status::Failed) {
                known.insert((row.id, row.key), (line, row.status));
            }
        }
    }
    Ok(known)
}

/// The rows of a file that may not be there, with their lines; what is no row, as a kill leaves it, is
/// passed over.
fn rows_of<T: DeserializeOwned>(place: &Path) -> Result<Vec<(String, T)>, Message> {
    let mut rows = Vec::new();
    lines_of(place, |line| {
        if let Ok(row) = serde_json::from_str(line) {
            rows.push((line.to_owned(), row));
        }
    })?;
    Ok(rows)
}

/// Goes through the lines of a file that may not be there, so far as they are text.
///
/// # Errors
/// It cannot be read.
pub(super) fn lines_of(place: &Path, mut take: impl FnMut(&str)) -> Result<(), Message> {
    let file = match File::open(place) {
        Ok(file) => file,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(unreadable(place, &e)),
    };
    let (mut file, mut line) = (BufReader::with_capacity(1 << 16, file), Vec::new());
    loop {
        line.clear();
        let read = file.read_until(b'\n', &mut line);
        if read.map_err(|e| unreadable(place, &e))? == 0 {
            return Ok(());
        }
        if let Ok(text) = std::str::from_utf8(&line) {
            take(text.trim_end_matches('\n'));
        }
    }
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
    replace_by(place, |mut file| file.write_all(content))
}

/// The same with what `write` writes.
fn replace_by(
    place: &Path,
    write: impl FnOnce(File) -> std::io::Result<()>,
) -> Result<(), Message> {
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    let beside = place.with_file_name(format!(".{name}.new"));
    File::create(&beside)
        .and_then(write)
        .and_then(|()| std::fs::rename(&beside, place))
        .map_err(|e| unwritable(place, &e))
}
