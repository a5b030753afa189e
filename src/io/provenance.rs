//! Where a result comes from: the inputs' hashes, the program's version, the seed, the command.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Message;
use super::source::{Read256, digest_of};

/// A file and its content at one time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Digested {
    /// Its name: of an input as given on the command line, of a written file within its folder.
    pub file: String,
    /// Its SHA-256, in hexadecimal digits.
    pub sha256: String,
}

/// What a reader needs to get the same result again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the program.
    pub program: String,
    /// Its version.
    pub version: String,
    /// The arguments of the command.
    pub command: Vec<String>,
    /// The seed of anything random; absent where nothing is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// The input files, as they were when they were read.
    pub inputs: Vec<Digested>,
    /// The files written beside `result.json`; empty where there is no folder.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<Digested>,
}

impl Provenance {
    /// Records the command and the digests of the inputs, taken while they were read.
    ///
    /// # Errors
    /// An input that was not read to its end, or was another when it was read again.
    pub fn of<'a>(
        command: &[String],
        inputs: impl IntoIterator<Item = &'a Path>,
        seed: Option<u64>,
    ) -> Result<Self, Message> {
        let inputs = inputs
            .into_iter()
            .map(|path| match digest_of(path) {
                Read256::Digest(sha256) => Ok(Digested {
                    file: path.display().to_string(),
                    sha256,
                }),
                Read256::Changed => Err(Message::bad_input("the file changed while it was read")
                    .in_file(path)
                    .remedy("run the command again when nothing writes to the file")),
                Read256::Unread => Err(Message::bad_input("the file was not read to its end")
                    .in_file(path)
                    .remedy("give each file only once")),
            })
            .collect::<Result<_, Message>>()?;
        Ok(Self {
            program: env!("CARGO_PKG_NAME").to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_vec(),
            seed,
            inputs,
            files: Vec::new(),
        })
    }
}
