//! Which files of a folder this program wrote: `result.json` names them with their digests.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use serde::Deserialize;
use sha2::{Digest, Sha256};

use crate::io::provenance::Digested;
use crate::io::source::hexadecimal;

/// The file that names the others.
pub(super) const RESULT: &str = "result.json";

#[derive(Deserialize)]
struct Result {
    schema: String,
    provenance: Written,
}

#[derive(Deserialize)]
struct Written {
    files: Vec<Digested>,
}

/// The files of the report that a folder holds, and whether each is still as it was written.
#[derive(Debug, Default)]
pub(super) struct Report(BTreeMap<String, String>);

/// Whose file it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Whose {
    /// Written by this program and not changed since.
    Ours,
    /// Written by this program and changed since.
    Changed,
    /// Somebody else's.
    Foreign,
}

impl Report {
    /// Reads which files belong to the report in a folder; none where there is no report.
    pub fn of(folder: &Path) -> Self {
        let Ok(bytes) = fs::read(folder.join(RESULT)) else {
            return Self::default();
        };
        match serde_json::from_slice::<Result>(&bytes) {
            Ok(result) if result.schema.starts_with("errsep.") => Self(
                result
                    .provenance
                    .files
                    .into_iter()
                    .map(|f| (f.file, f.sha256))
                    .chain([(RESULT.to_owned(), String::new())])
                    .collect(),
            ),
            _ => Self::default(),
        }
    }

    /// Whose the file of this name is.
    pub fn whose(&self, folder: &Path, name: &str) -> Whose {
        match self.0.get(name) {
            None => Whose::Foreign,
            Some(_) if name == RESULT => Whose::Ours,
            Some(written) => match digest(&folder.join(name)) {
                Ok(found) if found == *written => Whose::Ours,
                _ => Whose::Changed,
            },
        }
    }
}

fn digest(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut hash = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block)? {
            0 => return Ok(hexadecimal(hash)),
            n => hash.update(&block[..n]),
        }
    }
}
