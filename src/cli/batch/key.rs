//! By what a campaign's answer is known: the content of its files, its options and the version.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::UNIX_EPOCH;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::campaigns::Campaign;
use crate::io::source::hexadecimal;

/// A file as it was when it was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Input {
    pub path: PathBuf,
    /// Bytes.
    pub size: u64,
    /// Time of change, nanoseconds since 1970.
    pub changed: u64,
    /// SHA-256 in hexadecimal digits.
    pub sha256: String,
}

/// Files that have been read.
#[derive(Default)]
pub(super) struct Inputs {
    known: Mutex<HashMap<PathBuf, Input>>,
    /// Those that were read anew.
    fresh: Mutex<Vec<Input>>,
}

impl Inputs {
    pub fn remember(&mut self, input: Input) {
        let known = self.known.get_mut().unwrap_or_else(PoisonError::into_inner);
        known.insert(input.path.clone(), input);
    }

    /// Those that were read since the last call.
    pub fn take_fresh(&self) -> Vec<Input> {
        std::mem::take(&mut *self.fresh.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The digest of a file: the one known, as long as size and time of change are those.
    fn digest(&self, path: &Path) -> io::Result<String> {
        let (size, changed) = state(path)?;
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(input) = known().get(path)
            && (input.size, input.changed) == (size, changed)
        {
            return Ok(input.sha256.clone());
        }
        let input = Input {
            path: path.to_owned(),
            size,
            changed,
            sha256: sha256(path)?,
        };
        known().insert(path.to_owned(), input.clone());
        let sha256 = input.sha256.clone();
        let mut fresh = self.fresh.lock().unwrap_or_else(PoisonError::into_inner);
        fresh.push(input);
        Ok(sha256)
    }

    /// The key of a campaign. A file that cannot be read counts by that: the command says what is wrong
    /// with it.
    pub fn key(&self, campaign: &Campaign) -> String {
        let mut hash = Sha256::new();
        let mut add = |text: &str| {
            hash.update((text.len() as u64).to_le_bytes());
            hash.update(text);
        };
        add(env!("CARGO_PKG_VERSION"));
        campaign.as_listed.iter().for_each(|word| add(word));
        for file in &campaign.files {
            match self.digest(file) {
                Ok(digest) => add(&digest),
                Err(error) => add(&error.kind().to_string()),
            }
        }
        hexadecimal(hash)
    }
}

/// Size and time of change.
pub(super) fn state(path: &Path) -> io::Result<(u64, u64)> {
    let about = std::fs::metadata(path)?;
    let changed = about.modified()?.duration_since(UNIX_EPOCH);
    Ok((about.len(), changed.map_or(0, |t| t.as_nanos() as u64)))
}

fn sha256(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hexadecimal(hash)),
            n => hash.update(&buffer[..n]),
        }
    }
}
