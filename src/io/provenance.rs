//! Where a result comes from: the inputs' hashes, the program's version, the seed, the command.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::Message;

/// One input file as it was when it was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Input {
    /// Its name as given on the command line.
    pub file: String,
    /// Its SHA-256, in hexadecimal digits.
    pub sha256: String,
}

/// What a reader needs to get the same result again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// Name of the program.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// The arguments of the command.
    pub command: Vec<String>,
    /// The seed of anything random; absent where nothing is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// The input files.
    pub inputs: Vec<Input>,
}

impl Provenance {
    /// Hashes the inputs and records the command.
    ///
    /// # Errors
    /// An input that can no longer be read.
    pub fn of<'a>(
        inputs: impl IntoIterator<Item = &'a Path>,
        seed: Option<u64>,
    ) -> Result<Self, Message> {
        let inputs = inputs
            .into_iter()
            .map(|path| {
                Ok(Input {
                    file: path.display().to_string(),
                    sha256: sha256(path)?,
                })
            })
            .collect::<Result<_, Message>>()?;
        Ok(Self {
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            command: std::env::args().skip(1).collect(),
            seed,
            inputs,
        })
    }
}

/// The SHA-256 of a file, in hexadecimal digits.
///
/// # Errors
/// The file cannot be read.
pub fn sha256(path: &Path) -> Result<String, Message> {
    let unreadable =
        |e: std::io::Error| Message::bad_input(format!("cannot be read: {e}")).in_file(path);
    let mut file = BufReader::new(File::open(path).map_err(unreadable)?);
    let mut hash = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        let n = file.read(&mut block).map_err(unreadable)?;
        if n == 0 {
            break;
        }
        hash.update(&block[..n]);
    }
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}
