//! What changes from run to run: files read, parts written, time taken. One JSON object a line, added at
//! the end.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::key::{Input, Inputs};
use super::unwritable;
use crate::io::Message;

/// A part that is complete.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct PartDone {
    /// Name of its file.
    pub part: String,
    /// Its size and time of change when it was written.
    pub size: u64,
    pub changed: u64,
    /// SHA-256 over ids and keys of its rows.
    pub rows: String,
    /// How many of them failed.
    pub failed: usize,
}

/// What working out a part came to.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Report {
    pub part: PartDone,
    /// Campaigns that were worked out now, with the seconds of each.
    pub seconds: Vec<(String, f64)>,
    /// Files that were read for their keys.
    pub inputs: Vec<Input>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "lowercase")]
enum Line {
    Input(Input),
    Part(PartDone),
    Campaign { id: String, seconds: f64 },
}

/// The log of a folder.
pub(super) struct Log {
    place: PathBuf,
    file: File,
    pub inputs: Inputs,
    parts: HashMap<String, PartDone>,
}

impl Log {
    /// Opens the log of a folder. To `verify`, what it says of files is not trusted.
    ///
    /// # Errors
    /// It cannot be read or written.
    pub fn open(folder: &Path, verify: bool) -> Result<Self, Message> {
        let place = folder.join("log.ndjson");
        let failed = |e: &std::io::Error| unwritable(&place, e);
        let open = OpenOptions::new()
            .create(true)
            .append(true)
            .read(true)
            .open(&place);
        let file = open.map_err(|e| failed(&e))?;
        let (mut inputs, mut parts) = (Inputs::default(), HashMap::new());
        for line in BufReader::new(&file).split(b'\n') {
            let line = line.map_err(|e| failed(&e))?;
            // A line that a kill has cut off says nothing.
            match serde_json::from_slice(&line) {
                Ok(Line::Input(input)) if !verify => inputs.remember(input),
                Ok(Line::Part(part)) if !verify => {
                    parts.insert(part.part.clone(), part);
                }
                _ => {}
            }
        }
        Ok(Self {
            place,
            file,
            inputs,
            parts,
        })
    }

    /// What was told of a part.
    pub fn part(&self, name: &str) -> Option<&PartDone> {
        self.parts.get(name)
    }

    /// Tells that a part is complete, with the files read and the seconds of each campaign.
    ///
    /// # Errors
    /// The log cannot be written.
    pub fn tell(&mut self, report: Report) -> Result<(), Message> {
        let part = report.part;
        let inputs = report.inputs.into_iter().map(Line::Input);
        let times = report
            .seconds
            .into_iter()
            .map(|(id, seconds)| Line::Campaign { id, seconds });
        let mut text = Vec::new();
        // A log that was cut off in a line goes on in the next.
        text.push(b'\n');
        for line in inputs.chain(times).chain([Line::Part(part.clone())]) {
            serde_json::to_writer(&mut text, &line)
                .map_err(|e| unwritable(&self.place, &e.into()))?;
            text.push(b'\n');
        }
        let written = self.file.write_all(&text);
        written.map_err(|e| unwritable(&self.place, &e))?;
        self.parts.insert(part.part.clone(), part);
        Ok(())
    }
}
