//! Inputs as they are read: once, with their digest taken from the very bytes that are worked with.
//!
//! A command that records where its answer comes from begins a record; every input that is then read
//! to its end leaves its digest there. A pipe gives its bytes only once: what was read of it is kept,
//! so that a command may look at the first line before it chooses a reader.

use std::cell::RefCell;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Cursor, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use sha2::{Digest, Sha256};

/// The name that stands for standard input.
pub const STANDARD_INPUT: &str = "-";

/// What is kept of a pipe at most, bytes: longer ones are read on, but only once.
const KEPT: usize = 1 << 26;

thread_local! {
    static RECORD: RefCell<Option<Record>> = const { RefCell::new(None) };
}

/// An input that is held in memory under a name that no file needs to have, such as `<data>`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InMemory {
    /// The name by which arguments and messages call it.
    pub name: String,
    /// Its bytes.
    pub bytes: Arc<[u8]>,
}

/// What has been read since the record began.
struct Record {
    hashing: bool,
    in_memory: Vec<InMemory>,
    digests: Vec<(PathBuf, String)>,
    pipes: Vec<(PathBuf, Arc<Mutex<Pipe>>)>,
}

/// Begins the record of what this thread reads, with digests where they are wanted; an earlier one
/// ends.
pub fn begin_record(hashing: bool) {
    begin_record_with(hashing, Vec::new());
}

/// As [`begin_record`], with inputs that are held in memory: until the next record begins, a path
/// that is such a name opens these bytes.
pub fn begin_record_with(hashing: bool, in_memory: Vec<InMemory>) {
    RECORD.with_borrow_mut(|record| {
        *record = Some(Record {
            hashing,
            in_memory,
            digests: Vec::new(),
            pipes: Vec::new(),
        });
    });
}

/// Holds an input in memory beside those that the record began with.
pub fn hold(input: InMemory) {
    RECORD.with_borrow_mut(|record| {
        let record = record.get_or_insert_with(|| Record {
            hashing: false,
            in_memory: Vec::new(),
            digests: Vec::new(),
            pipes: Vec::new(),
        });
        record.in_memory.retain(|held| held.name != input.name);
        record.in_memory.push(input);
    });
}

/// Digests are wanted of what this thread reads from now on, whatever its record began with.
pub fn want_digests() {
    RECORD.with_borrow_mut(|record| {
        if let Some(record) = record {
            record.hashing = true;
        }
    });
}

impl Record {
    /// What is held in memory under this name, or has been read of this pipe.
    fn find(&self, path: &Path) -> Option<Bytes> {
        let named = |held: &&InMemory| path.as_os_str() == OsStr::new(&held.name);
        if let Some(held) = self.in_memory.iter().find(named) {
            return Some(Bytes::Memory(Cursor::new(Arc::clone(&held.bytes))));
        }
        let pipe = self.pipes.iter().find(|(p, _)| p == path);
        pipe.map(|(_, pipe)| Bytes::Pipe(Arc::clone(pipe), 0))
    }
}

/// What a record says of an input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Read256 {
    /// Its SHA-256, in hexadecimal digits.
    Digest(String),
    /// It was read twice and was another the second time.
    Changed,
    /// It was not read to its end.
    Unread,
}

/// The digest of an input as it was read since the record began.
pub fn digest_of(path: &Path) -> Read256 {
    RECORD.with_borrow(|record| {
        let digests = record.iter().flat_map(|r| &r.digests);
        let mut of_it = digests.filter(|(p, _)| p == path).map(|(_, digest)| digest);
        match of_it.next() {
            None => Read256::Unread,
            Some(first) if of_it.all(|other| other == first) => Read256::Digest(first.clone()),
            Some(_) => Read256::Changed,
        }
    })
}

/// SHA-256 in hexadecimal digits.
pub fn hexadecimal(hash: Sha256) -> String {
    let digits = |byte: &u8| [byte >> 4, byte & 15];
    let digest = hash.finalize();
    let digits = digest.iter().flat_map(digits);
    digits
        .filter_map(|digit| char::from_digit(u32::from(digit), 16))
        .collect()
}

/// A file, a pipe or standard input, being read.
pub struct Source {
    path: PathBuf,
    bytes: Bytes,
    hash: Option<Sha256>,
}

enum Bytes {
    File(File),
    Memory(Cursor<Arc<[u8]>>),
    Pipe(Arc<Mutex<Pipe>>, usize),
}

/// What can be read only once, and what was read of it.
struct Pipe {
    rest: Box<dyn Read + Send>,
    kept: Option<Vec<u8>>,
    given: usize,
}

impl Source {
    /// Opens an input; `-` is standard input.
    ///
    /// # Errors
    /// The system's own.
    pub fn open(path: &Path) -> io::Result<Self> {
        let known = RECORD.with_borrow(|record| record.as_ref().and_then(|r| r.find(path)));
        let bytes = match known {
            Some(known) => known,
            None if path == Path::new(STANDARD_INPUT) => piped(path, Box::new(io::stdin())),
            None => {
                let file = File::open(path)?;
                if file.metadata()?.is_file() {
                    Bytes::File(file)
                } else {
                    piped(path, Box::new(file))
                }
            }
        };
        Ok(Self {
            path: path.to_owned(),
            bytes,
            hash: RECORD
                .with_borrow(|record| record.as_ref().is_some_and(|r| r.hashing))
                .then(Sha256::new),
        })
    }
}

fn piped(path: &Path, rest: Box<dyn Read + Send>) -> Bytes {
    let pipe = Arc::new(Mutex::new(Pipe {
        rest,
        kept: Some(Vec::new()),
        given: 0,
    }));
    RECORD.with_borrow_mut(|record| {
        if let Some(record) = record {
            record.pipes.push((path.to_owned(), Arc::clone(&pipe)));
        }
    });
    Bytes::Pipe(pipe, 0)
}

impl Pipe {
    fn read_at(&mut self, place: usize, buffer: &mut [u8]) -> io::Result<usize> {
        if place < self.given {
            let kept = self.kept.as_deref().ok_or_else(|| {
                io::Error::other("it can be read only once, and is too long to be kept")
            })?;
            return (&kept[place..]).read(buffer);
        }
        let n = self.rest.read(buffer)?;
        self.given += n;
        if let Some(kept) = &mut self.kept {
            kept.extend_from_slice(&buffer[..n]);
        }
        if self.given > KEPT {
            self.kept = None;
        }
        Ok(n)
    }
}

impl Source {
    /// Reads on, which any thread may do; that the end was met is recorded by [`Self::note_end`] alone.
    ///
    /// # Errors
    /// The system's own.
    pub(super) fn read_apart(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = match &mut self.bytes {
            Bytes::File(file) => file.read(buffer)?,
            Bytes::Memory(bytes) => bytes.read(buffer)?,
            Bytes::Pipe(pipe, place) => {
                let mut pipe = pipe.lock().unwrap_or_else(PoisonError::into_inner);
                let n = pipe.read_at(*place, buffer)?;
                *place += n;
                n
            }
        };
        if n > 0
            && let Some(hash) = &mut self.hash
        {
            hash.update(&buffer[..n]);
        }
        Ok(n)
    }

    /// Leaves the digest in the record of this thread, once everything has been read.
    pub(super) fn note_end(&mut self) {
        if let Some(hash) = self.hash.take() {
            RECORD.with_borrow_mut(|record| {
                if let Some(record) = record {
                    let read = (self.path.clone(), hexadecimal(hash));
                    record.digests.push(read);
                }
            });
        }
    }

    /// Whether its digest is wanted.
    #[cfg(feature = "parquet")]
    pub(super) fn is_hashed(&self) -> bool {
        self.hash.is_some()
    }

    /// The bytes of a file or of what is held in memory; unknown of a pipe.
    pub(super) fn length(&self) -> Option<u64> {
        match &self.bytes {
            Bytes::File(file) => file.metadata().ok().map(|m| m.len()),
            Bytes::Memory(bytes) => Some(bytes.get_ref().len() as u64),
            Bytes::Pipe(..) => None,
        }
    }
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.read_apart(buffer)?;
        if n == 0 && !buffer.is_empty() {
            self.note_end();
        }
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn whole(path: &Path) -> Vec<u8> {
        let mut bytes = Vec::new();
        Source::open(path).unwrap().read_to_end(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn the_digest_is_that_of_what_was_read() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(b"abc").unwrap();
        begin_record(true);
        assert_eq!(digest_of(file.path()), Read256::Unread);
        assert_eq!(whole(file.path()), b"abc");
        // The SHA-256 of "abc" in FIPS 180-2, appendix B.1.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(digest_of(file.path()), Read256::Digest(abc.to_owned()));
        // What happens to the file afterwards does not matter; what a second reading finds does.
        file.write_all(b"d").unwrap();
        assert_eq!(digest_of(file.path()), Read256::Digest(abc.to_owned()));
        assert_eq!(whole(file.path()), b"abcd");
        assert_eq!(digest_of(file.path()), Read256::Changed);
        begin_record(true);
        assert_eq!(digest_of(file.path()), Read256::Unread);
    }

    #[test]
    fn what_is_in_memory_is_read_by_its_name_until_the_next_record() {
        let held = InMemory {
            name: "<data>".to_owned(),
            bytes: Arc::from(&b"abc"[..]),
        };
        begin_record_with(true, vec![held]);
        let name = Path::new("<data>");
        for _ in 0..2 {
            assert_eq!(whole(name), b"abc");
        }
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(digest_of(name), Read256::Digest(abc.to_owned()));
        begin_record(true);
        assert!(Source::open(name).is_err());
    }

    #[test]
    fn a_reading_that_stops_early_has_no_digest() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(b"abc").unwrap();
        begin_record(true);
        let mut two = [0; 2];
        let mut source = Source::open(file.path()).unwrap();
        source.read_exact(&mut two).unwrap();
        drop(source);
        assert_eq!(digest_of(file.path()), Read256::Unread);
    }
}
