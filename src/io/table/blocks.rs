//! Reading a file in chunks of whole lines.

use std::io;

use memchr::{memchr_iter, memrchr};

use super::chunk::{Chunk, LONGEST_LINE};
use crate::io::source::Source;

/// Bytes of a chunk: small enough for the cache of a processor, large enough for few seams between chunks.
const CHUNK: usize = 1 << 18;

/// A file of which the beginning was read to see how it is written.
pub(super) struct Blocks {
    source: Source,
    /// What was read behind the last whole line.
    rest: Vec<u8>,
    lines: usize,
    end: u8,
    given: u64,
    /// Bytes of the whole, where they are known.
    length: Option<u64>,
    is_over: bool,
}

impl Blocks {
    /// `head` is what was read of `source`; `end` is the byte after which a line begins.
    pub fn new(source: Source, head: Vec<u8>, end: u8) -> Self {
        Self {
            length: source.length(),
            source,
            rest: head,
            lines: 0,
            end,
            given: 0,
            is_over: false,
        }
    }

    /// Fills a chunk; false where nothing is left. Any thread may do that; see [`Self::note_end`].
    ///
    /// # Errors
    /// The system's own.
    pub fn fill(&mut self, chunk: &mut Chunk) -> io::Result<bool> {
        if self.is_over && self.rest.is_empty() {
            chunk.length = 0;
            return Ok(false);
        }
        // The first chunk is what was read already, if a line ends in it.
        let is_first = self.given == 0 && self.rest.contains(&self.end);
        let wanted = if is_first {
            self.rest.len()
        } else {
            self.chunk()
        };
        let mut filled = self.rest.len();
        chunk
            .bytes
            .resize(chunk.bytes.len().max(wanted).max(filled), 0);
        chunk.bytes[..filled].copy_from_slice(&self.rest);
        let cut = loop {
            while filled < chunk.bytes.len() && !self.is_over && !(is_first && filled >= wanted) {
                match self.source.read_apart(&mut chunk.bytes[filled..]) {
                    Ok(0) => self.is_over = true,
                    Ok(n) => filled += n,
                    Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                    Err(e) => return Err(e),
                }
            }
            if self.is_over {
                break filled;
            }
            match memrchr(self.end, &chunk.bytes[..filled]) {
                Some(at) => break at + 1,
                // No line is that long: the walk refuses it.
                None if filled >= LONGEST_LINE => break filled,
                None => chunk.bytes.resize(filled + CHUNK, 0),
            }
        };
        self.rest.clear();
        self.rest.extend_from_slice(&chunk.bytes[cut..filled]);
        chunk.length = cut;
        chunk.lines_before = self.lines;
        self.lines += memchr_iter(self.end, &chunk.bytes[..cut]).count();
        self.given += cut as u64;
        Ok(cut > 0)
    }

    /// Bytes of the next chunk: of a small file no more than are left, and one in which its end is met.
    fn chunk(&self) -> usize {
        let left = self.length.map(|whole| whole.saturating_sub(self.given));
        left.map_or(CHUNK, |left| {
            (left.min(CHUNK as u64) as usize + 1).min(CHUNK)
        })
    }

    /// Records the digest in this thread, if everything has been read.
    pub fn note_end(&mut self) {
        if self.is_over {
            self.source.note_end();
        }
    }

    /// How many times as long as what was given until now the whole is, where that is known.
    pub fn whole_to_given(&self) -> Option<f64> {
        let length = self.length?;
        (self.given > 0).then(|| length as f64 / self.given as f64)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};

    use super::*;

    #[test]
    fn chunks_are_no_longer_than_what_is_left_of_the_file() {
        let text = "12345\n".repeat(10_000) + "the end";
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        let mut source = Source::open(file.path()).unwrap();
        let mut head = vec![0; 1000];
        source.read_exact(&mut head).unwrap();
        let mut blocks = Blocks::new(source, head, b'\n');
        let mut given = Vec::new();
        loop {
            let mut chunk = Chunk::default();
            if !blocks.fill(&mut chunk).unwrap() {
                assert!(chunk.bytes.is_empty());
                break;
            }
            let left = text.len() - given.len();
            assert!(chunk.bytes.len() <= left + 1, "{left} bytes are left");
            given.extend_from_slice(&chunk.bytes[..chunk.length]);
        }
        assert!(given == text.as_bytes());
    }
}
