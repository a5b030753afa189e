//! A batch whose parts are worked out by other processes, such as those of a cluster: one process reads
//! the list and hands out tasks, any number of others work, and what they report goes back to the first.
//! The folder is that of `errsep batch`, byte for byte but for its log.

use std::path::PathBuf;

use indicatif::ProgressBar;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::key::Inputs;
use super::log::Report;
use super::parts::{How, Part};
use super::{Batch, Shard};
use crate::io::Message;
use crate::io::source::{InMemory, begin_record_with};

/// What is asked of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Asked {
    /// The list, as [`errsep batch`](super::Args) takes it, or the name of an input in memory.
    pub list: PathBuf,
    /// Folder of the answers, which all processes see under this path.
    pub out: PathBuf,
    /// Campaigns at the same time in one task.
    pub jobs: usize,
    /// Try again what failed.
    pub retry_failed: bool,
    /// Read every input again.
    pub verify: bool,
    /// Write every part as Parquet too.
    pub parquet: bool,
}

/// The process that hands out tasks. While it lives, no other run works on its folder.
pub struct Shared(Batch);

/// What a batch came to, in campaigns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// In the list.
    pub campaigns: usize,
    /// Worked out now.
    pub worked_out: usize,
    /// Without an answer.
    pub failed: usize,
}

/// A part to be worked out.
#[derive(Serialize, Deserialize)]
struct Task {
    part: Part,
    how: How,
}

impl Shared {
    /// Reads the list and what is done already. Paths of the list are relative to its folder, which for a
    /// list in memory is that in front of its name.
    ///
    /// # Errors
    /// The list is wrong, or the folder cannot be written.
    pub fn open(asked: &Asked, in_memory: Vec<InMemory>) -> Result<Self, Message> {
        begin_record_with(false, in_memory);
        let how = How {
            out: asked.out.clone(),
            jobs: super::at_once(Some(asked.jobs)),
            retry_failed: asked.retry_failed,
            verify: asked.verify,
            parquet: asked.parquet,
        };
        Batch::open(&asked.list, how, Shard { index: 1, of: 1 }).map(Self)
    }

    /// The tasks, as text that [`work`] takes; with how many campaigns each has.
    ///
    /// # Errors
    /// A path that is no text.
    pub fn tasks(&mut self) -> Result<Vec<(String, usize)>, Message> {
        let parts = std::mem::take(&mut self.0.waiting).into_iter();
        let task = |part: Part| {
            let count = part.campaigns.len();
            let how = self.0.how.clone();
            Ok((as_text(&Task { part, how })?, count))
        };
        parts.map(task).collect()
    }

    /// Takes the report of a task.
    ///
    /// # Errors
    /// It is none, or the log cannot be written.
    pub fn take(&mut self, report: &str) -> Result<(), Message> {
        self.0.take(from_text::<Report>(report)?)
    }

    /// Writes the page.
    ///
    /// # Errors
    /// The folder cannot be read or written.
    pub fn finish(self) -> Result<Counts, Message> {
        let outcome = self.0.finish()?;
        Ok(Counts {
            campaigns: outcome.campaigns,
            worked_out: outcome.worked_out,
            failed: outcome.failed,
        })
    }
}

/// Works out a task, in any process, and returns its report. Campaigns that a killed process has left in
/// the folder are not worked out again.
///
/// # Errors
/// It is no task of this version, or the folder cannot be written.
pub fn work(task: &str) -> Result<String, Message> {
    let Task { part, how } = from_text(task)?;
    let report = part.work(&Inputs::default(), &how, &ProgressBar::hidden())?;
    as_text(&report)
}

fn as_text<T: Serialize>(value: &T) -> Result<String, Message> {
    serde_json::to_string(value).map_err(|e| {
        Message::bad_input(format!("a task cannot be written: {e}"))
            .remedy("give paths that are text in UTF-8")
    })
}

fn from_text<T: DeserializeOwned>(text: &str) -> Result<T, Message> {
    serde_json::from_str(text).map_err(|e| {
        Message::bad_input(format!("this is no task or report of a batch: {e}"))
            .remedy("let all processes have the same version of errsep")
    })
}
