//! A checkpoint file: what a run needs to go on after it was killed.
//!
//! Written as CBOR, which keeps every bit of a number and knows infinity. Each save goes to a
//! file beside the checkpoint that then takes its place, so that a run killed while saving still
//! finds the previous one.

use std::fs::{self, File};
use std::io::{BufReader, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use argmin::core::Error;
use argmin::core::checkpointing::{Checkpoint, CheckpointingFrequency};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Saves a run to one file every few iterations, and continues from it.
#[derive(Debug, Clone)]
pub struct CheckpointFile {
    path: PathBuf,
    every: u64,
}

impl CheckpointFile {
    /// A checkpoint at `path`, saved after every `every` iterations (0 counts as 1).
    pub fn new(path: impl Into<PathBuf>, every: u64) -> Self {
        Self {
            path: path.into(),
            every: every.max(1),
        }
    }

    fn explained(&self, what: &str, why: impl std::fmt::Display) -> Error {
        Error::msg(format!(
            "checkpoint {} cannot be {what}: {why}",
            self.path.display()
        ))
    }
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    PathBuf::from(name)
}

impl<S, I> Checkpoint<S, I> for CheckpointFile
where
    S: Serialize + DeserializeOwned,
    I: Serialize + DeserializeOwned,
{
    fn save(&self, solver: &S, state: &I) -> Result<(), Error> {
        let fresh = beside(&self.path);
        let file = File::create(&fresh).map_err(|e| self.explained("written", e))?;
        let mut writer = BufWriter::new(file);
        ciborium::into_writer(&(solver, state), &mut writer)
            .map_err(|e| self.explained("written", e))?;
        writer.flush().map_err(|e| self.explained("written", e))?;
        fs::rename(&fresh, &self.path).map_err(|e| self.explained("written", e))
    }

    fn load(&self) -> Result<Option<(S, I)>, Error> {
        match File::open(&self.path) {
            Ok(file) => ciborium::from_reader(BufReader::new(file))
                .map(Some)
                .map_err(|e| self.explained("read: remove it to start afresh", e)),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            Err(e) => Err(self.explained("read", e)),
        }
    }

    fn frequency(&self) -> CheckpointingFrequency {
        CheckpointingFrequency::Every(self.every)
    }
}
