//! By what a campaign's answer is known: the content of its files, its options and the version.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::UNIX_EPOCH;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::campaigns::Campaign;
use super::selection::Held;
use crate::io::source::{Read256, digest_of, hexadecimal};

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

    fn known(&self) -> MutexGuard<'_, HashMap<PathBuf, Input>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The digest of a file, where it is known: as long as size and time of change are those.
    fn known_digest(&self, campaign: &Campaign, path: &Path) -> Result<Option<String>, io::Error> {
        let (size, changed) = state(campaign.place(path))?;
        let known = self.known();
        let same = known
            .get(path)
            .filter(|input| (input.size, input.changed) == (size, changed));
        Ok(same.map(|input| input.sha256.clone()))
    }

    /// The digest of a file, or of the rows that are selected of it: the one known, or that of what is
    /// there now.
    fn digest(&self, campaign: &Campaign, path: &Path, held: &Held) -> io::Result<String> {
        if let Some(digest) = self.known_digest(campaign, path)? {
            return Ok(digest);
        }
        let (size, changed) = state(campaign.place(path))?;
        let input = Input {
            path: path.to_owned(),
            size,
            changed,
            sha256: match held.get(path) {
                Some(Ok(rows)) => hexadecimal(Sha256::new_with_prefix(rows)),
                Some(Err(_)) => return Err(io::ErrorKind::InvalidData.into()),
                None => sha256(path)?,
            },
        };
        let sha256 = input.sha256.clone();
        let before = self.known().insert(path.to_owned(), input.clone());
        if before.as_ref() != Some(&input) {
            let mut fresh = self.fresh.lock().unwrap_or_else(PoisonError::into_inner);
            fresh.push(input);
        }
        Ok(sha256)
    }

    /// The key of a campaign. A file that cannot be read counts by that: the command says what is wrong
    /// with it.
    pub fn key(&self, campaign: &Campaign, held: &Held) -> String {
        let digest = |file: &PathBuf| told(self.digest(campaign, file, held));
        let digests = campaign.files.iter().map(digest);
        key(campaign, digests)
    }

    /// The key of a campaign, where nothing has to be read for it.
    pub fn known_key(&self, campaign: &Campaign) -> Option<String> {
        let digests = campaign
            .files
            .iter()
            .map(|file| match self.known_digest(campaign, file) {
                Ok(digest) => digest,
                Err(error) => Some(told(Err(error))),
            });
        let digests: Option<Vec<String>> = digests.collect();
        Some(key(campaign, digests?.into_iter()))
    }

    /// The first of a campaign's files that was another when this thread read it than when the key was
    /// made.
    pub fn changed_since<'c>(&self, campaign: &'c Campaign) -> Option<&'c Path> {
        let known = self.known();
        let other = |file: &&PathBuf| match (digest_of(file), known.get(*file)) {
            (Read256::Digest(read), Some(input)) => read != input.sha256,
            (Read256::Changed, _) => true,
            _ => false,
        };
        campaign.files.iter().find(other).map(PathBuf::as_path)
    }
}

fn key(campaign: &Campaign, digests: impl Iterator<Item = String>) -> String {
    let mut hash = Sha256::new();
    let mut add = |text: &str| {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text);
    };
    add(env!("CARGO_PKG_VERSION"));
    campaign.as_listed.iter().for_each(|word| add(word));
    digests.for_each(|digest| add(&digest));
    hexadecimal(hash)
}

/// What a file counts by in the key.
fn told(digest: io::Result<String>) -> String {
    digest.unwrap_or_else(|error| error.kind().to_string())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::source::{Source, begin_record};

    #[test]
    fn a_file_that_changes_between_key_and_reading_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.csv");
        std::fs::write(&file, "x,deviation\n0,1\n").unwrap();
        let campaign = Campaign {
            id: "a".to_owned(),
            arguments: Vec::new(),
            files: vec![file.clone()],
            selection: None,
            as_listed: Vec::new(),
        };
        let inputs = Inputs::default();
        assert_eq!(inputs.known_key(&campaign), None);
        let key = inputs.key(&campaign, &Held::new());
        assert_eq!(inputs.known_key(&campaign), Some(key));
        let read = || {
            begin_record(true);
            Source::open(&file)?.read_to_end(&mut Vec::new())
        };
        read().unwrap();
        assert_eq!(inputs.changed_since(&campaign), None);
        std::fs::write(&file, "x,deviation\n0,22\n").unwrap();
        read().unwrap();
        assert_eq!(inputs.changed_since(&campaign), Some(file.as_path()));
        assert_eq!(inputs.known_key(&campaign), None);
    }
}
