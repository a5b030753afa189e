//! One line: read, checked to be text, split into fields.

use std::io::{BufRead, Read};

use csv_core::ReadRecordResult;

use super::TableReader;
use super::trouble::cannot_read;
use crate::io::dialect::{LineEnd, is_binary, is_skipped};
use crate::io::message::{Message, Place};

/// A longer line is not that of a table, in bytes.
const LONGEST_LINE: u64 = 1 << 20;

impl TableReader {
    /// Reads and splits the next line that is neither blank nor a comment.
    pub(super) fn next_line(&mut self) -> Result<bool, Message> {
        let end = match self.dialect.line_end {
            LineEnd::Cr => b'\r',
            LineEnd::Lf | LineEnd::CrLf => b'\n',
        };
        loop {
            self.line.clear();
            let n = (&mut self.source)
                .take(LONGEST_LINE)
                .read_until(end, &mut self.line)
                .map_err(|e| cannot_read(&self.path, &e))?;
            if n == 0 {
                return Ok(false);
            }
            self.line_number += 1;
            if n as u64 == LONGEST_LINE {
                return Err(self
                    .at_line(self.line_number, "the line is longer than 1 MiB")
                    .remedy("is this a table of readings? Write one row a line"));
            }
            while matches!(self.line.last(), Some(b'\n' | b'\r')) {
                self.line.pop();
            }
            if !is_skipped(&self.line) {
                break;
            }
        }
        // Most lines are ASCII without quotes: one look at each byte splits them.
        if self.split_plain() {
            return Ok(true);
        }
        let wrong = match std::str::from_utf8(&self.line) {
            Err(e) => Some(e.valid_up_to()),
            Ok(_) => self.line.iter().position(|&b| is_binary(b)),
        };
        if let Some(byte) = wrong {
            return Err(self
                .at_line(
                    self.line_number,
                    format!(
                        "byte {} of the line (0x{:02X}) is not text",
                        byte + 1,
                        self.line[byte]
                    ),
                )
                .remedy("save the file as plain text (CSV, UTF-8)"));
        }
        self.split()
    }

    fn split(&mut self) -> Result<bool, Message> {
        // The line end closes the record; without it a quote was left open.
        self.line.push(b'\n');
        self.fields.resize(self.line.len(), 0);
        self.ends.resize(self.line.len() + 1, 0);
        self.splitter.reset();
        let (result, _, _, fields) =
            self.splitter
                .read_record(&self.line, &mut self.fields, &mut self.ends);
        self.line.pop();
        if result != ReadRecordResult::Record {
            let text = String::from_utf8_lossy(&self.line).into_owned();
            let quote = text.rfind('"').unwrap_or(0);
            return Err(
                Message::bad_input("a quote is opened and not closed on this line")
                    .at(Place {
                        file: self.path.clone(),
                        line: self.line_number,
                        column: text[..quote].chars().count() + 1,
                        text,
                        length: 1,
                    })
                    .remedy("close the quote, or remove it"),
            );
        }
        self.field_count = fields;
        Ok(true)
    }

    /// Splits a line in which every delimiter ends a field; false where a byte is not ASCII, binary, a quote
    /// or a line end.
    fn split_plain(&mut self) -> bool {
        let delimiter = self.dialect.delimiter.byte();
        self.ends.clear();
        self.fields.clear();
        let mut start = 0;
        for (at, byte) in self.line.iter().enumerate() {
            if *byte == delimiter {
                self.fields.extend_from_slice(&self.line[start..at]);
                self.ends.push(self.fields.len());
                start = at + 1;
            } else if NOT_PLAIN[usize::from(*byte)] {
                return false;
            }
        }
        self.fields.extend_from_slice(&self.line[start..]);
        self.ends.push(self.fields.len());
        self.field_count = self.ends.len();
        true
    }
}

/// Bytes that a line may not have to be split by its delimiters alone.
const NOT_PLAIN: [bool; 256] = {
    let mut not_plain = [false; 256];
    let mut byte = 0;
    while byte < 256 {
        not_plain[byte] =
            byte >= 128 || is_binary(byte as u8) || matches!(byte as u8, b'"' | b'\r' | b'\n');
        byte += 1;
    }
    not_plain
};
