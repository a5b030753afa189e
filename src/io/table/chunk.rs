//! A piece of a file that ends where a line ends, and the walk through its lines.

use std::cell::Cell;

use csv_core::ReadRecordResult;
use memchr::memchr;

use super::row::{Cells, Row};
use super::sheet::Sheet;
use super::trouble::{no_text, open_quote, wrong_count};
use crate::io::dialect::{Decimal, Dialect, LineEnd, is_binary, is_skipped};
use crate::io::message::Message;

/// A longer line is not that of a table, in bytes.
pub(super) const LONGEST_LINE: usize = 1 << 20;

/// Bytes of a field, as few as there are in most tables of readings.
const FIELD: usize = 8;

/// Whole lines of a file.
#[derive(Default)]
pub(super) struct Chunk {
    /// What was read; only the first `length` bytes count.
    pub bytes: Vec<u8>,
    /// How many bytes are those of the lines.
    pub length: usize,
    /// The lines of the file before these.
    pub lines_before: usize,
    /// Where fields and lines end, if delimiters and line ends alone decide that.
    seams: Option<Vec<u32>>,
    /// Room for `seams`.
    room: Vec<u32>,
}

impl Chunk {
    /// Finds where fields end. A chunk with anything but plain ASCII, or with quotes, is left to the walk,
    /// which looks at it line by line.
    pub fn find_seams(&mut self, dialect: Dialect) {
        let mut seams = self.seams.take().unwrap_or(std::mem::take(&mut self.room));
        seams.clear();
        let bytes = &self.bytes[..self.length];
        if !is_plain(bytes, dialect.line_end) || u32::try_from(bytes.len()).is_err() {
            self.room = seams;
            return;
        }
        seams.reserve(bytes.len() / FIELD);
        mark(bytes, dialect.delimiter.byte(), &mut seams);
        if bytes.last().is_some_and(|b| *b != b'\n') {
            seams.push(bytes.len() as u32);
        }
        self.seams = Some(seams);
    }

    fn text(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

/// Adds the places of a delimiter and of line ends, eight bytes at a time.
fn mark(bytes: &[u8], delimiter: u8, seams: &mut Vec<u32>) {
    const EACH: u64 = 0x0101_0101_0101_0101;
    const LOW: u64 = 0x7F7F_7F7F_7F7F_7F7F;
    let (delimiters, ends) = (EACH * u64::from(delimiter), EACH * u64::from(b'\n'));
    // The high bit of every byte that is zero; no carry leaves a byte.
    let zeros = |word: u64| !(((word & LOW) + LOW) | word | LOW);
    let (words, rest) = bytes.as_chunks::<8>();
    for (at, word) in (0_u32..).step_by(8).zip(words) {
        let word = u64::from_le_bytes(*word);
        let mut found = zeros(word ^ delimiters) | zeros(word ^ ends);
        while found != 0 {
            seams.push(at + found.trailing_zeros() / 8);
            found &= found - 1;
        }
    }
    let behind = 8 * words.len();
    for (at, byte) in rest.iter().enumerate() {
        if *byte == delimiter || *byte == b'\n' {
            seams.push((behind + at) as u32);
        }
    }
}

/// Whether every delimiter ends a field and every line end a line: no quotes, nothing but ASCII, no line
/// end of another kind.
fn is_plain(bytes: &[u8], line_end: LineEnd) -> bool {
    let odd =
        |b: u8| (b < b' ') & (b != b'\t') & (b != b'\n') & (b != b'\r') | (b >= 128) | (b == b'"');
    // Without early ends, so that many bytes are looked at together.
    if bytes.iter().fold(false, |found, b| found | odd(*b)) {
        return false;
    }
    match line_end {
        LineEnd::Cr => false,
        LineEnd::Lf => memchr(b'\r', bytes).is_none(),
        LineEnd::CrLf => {
            let next = bytes.iter().skip(1).chain([&b'\r']);
            !bytes.iter().zip(next).fold(false, |found, (a, b)| {
                found | ((*a == b'\r') & (*b != b'\n'))
            })
        }
    }
}

/// Where a walk through a chunk stands.
#[derive(Default)]
pub(super) struct Walk {
    at: usize,
    seam: usize,
    /// The line at hand, as the file counts them.
    line_number: usize,
    splitter: Option<Box<csv_core::Reader>>,
    copy: Vec<u8>,
    unquoted: Vec<u8>,
    ends: Vec<u32>,
    places: Vec<usize>,
}

impl Walk {
    /// Stands before the first line of a chunk.
    pub fn begin(&mut self, chunk: &Chunk) {
        self.at = 0;
        self.seam = 0;
        self.line_number = chunk.lines_before;
    }

    /// Goes on to the next line that is no blank one, no comment and no empty row; false where the chunk has none left.
    pub fn seek(&mut self, end: u8, chunk: &Chunk) -> bool {
        let text = chunk.text();
        while let Some(first) = text.get(self.at) {
            if matches!(first, b'!' | b'$'..=b'+' | b'-'..=b':' | b'<'..=b'~') {
                return true;
            }
            let line = &text[self.at..];
            let line = &line[..memchr(end, line).map_or(line.len(), |n| n + 1)];
            if line.len() >= LONGEST_LINE || !is_skipped(line) {
                return true;
            }
            self.at += line.len();
            self.line_number += 1;
            let seams = chunk.seams.iter().flatten().skip(self.seam);
            self.seam += seams.take_while(|at| (**at as usize) < self.at).count();
        }
        false
    }

    /// The next line, split into fields; `None` at the end of the chunk. Blank lines and comments are passed
    /// over by [`Self::seek`].
    ///
    /// # Errors
    /// A line that is too long, is no text, or has an open quote.
    pub fn next<'a>(
        &'a mut self,
        sheet: &'a Sheet,
        chunk: &'a Chunk,
        decimal: &'a Cell<Decimal>,
    ) -> Result<Option<Row<'a>>, Message> {
        let text = chunk.text();
        let start = self.at;
        if start >= text.len() {
            return Ok(None);
        }
        let (stop, ends) = match &chunk.seams {
            Some(seams) => {
                let seams = &seams[self.seam..];
                let is_end = |at: &u32| text.get(*at as usize).is_none_or(|b| *b == b'\n');
                let count = seams.iter().position(is_end).map_or(seams.len(), |n| n + 1);
                self.seam += count;
                let ends = &seams[..count];
                let stop = ends.last().map_or(text.len(), |at| *at as usize + 1);
                (stop.min(text.len()), Some(ends))
            }
            None => {
                let end = sheet.dialect.line_end.last_byte();
                let stop = memchr(end, &text[start..]).map_or(text.len(), |n| start + n + 1);
                (stop, None)
            }
        };
        self.at = stop;
        self.line_number += 1;
        if stop - start >= LONGEST_LINE {
            return Err(sheet
                .at_line(self.line_number, "the line is longer than 1 MiB")
                .remedy("is this a table of readings? Write one row a line"));
        }
        let line = without_end(&text[start..stop]);
        let cells = match ends {
            Some(ends) => Cells::Line {
                line,
                fields: text,
                start,
                ends,
                between: 1,
            },
            None => {
                self.split(sheet, line)?;
                Cells::Line {
                    line,
                    fields: &self.unquoted,
                    start: 0,
                    ends: &self.ends,
                    between: 0,
                }
            }
        };
        Ok(Some(Row::new(sheet, decimal, cells, self.line_number)))
    }

    fn split(&mut self, sheet: &Sheet, line: &[u8]) -> Result<(), Message> {
        let wrong = match std::str::from_utf8(line) {
            Err(e) => Some(e.valid_up_to()),
            Ok(_) => line.iter().position(|&b| is_binary(b)),
        };
        if let Some(byte) = wrong {
            return Err(no_text(sheet, self.line_number, line, byte));
        }
        // The line end closes the record; without it a quote was left open.
        self.copy.clear();
        self.copy.extend_from_slice(line);
        self.copy.push(b'\n');
        self.unquoted.resize(self.copy.len(), 0);
        self.places.resize(self.copy.len() + 1, 0);
        let delimiter = sheet.dialect.delimiter.byte();
        let splitter = self.splitter.get_or_insert_with(|| {
            let splitter = csv_core::ReaderBuilder::new().delimiter(delimiter).build();
            Box::new(splitter)
        });
        splitter.reset();
        let (result, _, _, fields) =
            splitter.read_record(&self.copy, &mut self.unquoted, &mut self.places);
        if result != ReadRecordResult::Record {
            return Err(open_quote(sheet, self.line_number, line));
        }
        self.ends.clear();
        let ends = self.places[..fields].iter();
        self.ends.extend(ends.map(|at| *at as u32));
        Ok(())
    }
}

fn without_end(mut line: &[u8]) -> &[u8] {
    while let [rest @ .., b'\n' | b'\r'] = line {
        line = rest;
    }
    line
}

/// The same row, if it has the fields that the first line names.
///
/// # Errors
/// It has fewer, or more that are not empty.
pub(super) fn complete<'a>(sheet: &Sheet, row: Row<'a>) -> Result<Row<'a>, Message> {
    let (expected, found) = (sheet.names.len(), row.field_count());
    if found == expected || (found > expected && (expected..found).all(|i| row.is_blank(i))) {
        return Ok(row);
    }
    Err(wrong_count(sheet, row, found))
}
