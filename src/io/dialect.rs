//! How a table is written: byte-order mark, line ends, delimiter, decimal mark. Detected, and said.

use std::fmt;

/// How lines end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineEnd {
    /// `\n`
    Lf,
    /// `\r\n`
    CrLf,
    /// `\r` alone.
    Cr,
}

impl LineEnd {
    /// The byte after which the next line begins.
    pub(super) const fn last_byte(self) -> u8 {
        match self {
            Self::Cr => b'\r',
            Self::Lf | Self::CrLf => b'\n',
        }
    }
}

/// What separates the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// A tab.
    Tab,
}

impl Delimiter {
    /// The byte in the file.
    pub const fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
        }
    }
}

/// What separates the whole part of a number from its fraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decimal {
    /// `1.5`
    Point,
    /// `1,5`
    Comma,
    /// No number with a fraction was seen yet; the first one decides.
    Undecided,
}

/// How a table is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dialect {
    /// The file begins with a UTF-8 byte-order mark.
    pub byte_order_mark: bool,
    /// Line ends.
    pub line_end: LineEnd,
    /// Field delimiter.
    pub delimiter: Delimiter,
    /// Decimal mark.
    pub decimal: Decimal,
    /// It is no text but columns in a Parquet file; the rest is how its rows are written as text.
    pub is_parquet: bool,
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_parquet {
            return f.write_str("Parquet");
        }
        let delimiter = match self.delimiter {
            Delimiter::Comma => "comma",
            Delimiter::Semicolon => "semicolon",
            Delimiter::Tab => "tab",
        };
        let decimal = match self.decimal {
            Decimal::Comma => "decimal comma",
            Decimal::Point | Decimal::Undecided => "decimal point",
        };
        let line_end = match self.line_end {
            LineEnd::Lf => "LF",
            LineEnd::CrLf => "CRLF",
            LineEnd::Cr => "CR",
        };
        let mark = if self.byte_order_mark {
            " with byte-order mark"
        } else {
            ""
        };
        write!(
            f,
            "UTF-8{mark}, {line_end} line ends, fields separated by {delimiter}, {decimal}"
        )
    }
}

pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Why the beginning of a file is not that of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NotATable {
    Empty,
    Utf16,
    /// A byte that is no text, at a line and a column from 1.
    Binary {
        line: usize,
        column: usize,
        byte: u8,
    },
}

impl Dialect {
    /// Reads the dialect off the beginning of a file (`whole`: it is all of the file).
    pub(super) fn detect(head: &[u8], whole: bool) -> Result<Self, NotATable> {
        if head.starts_with(b"\xFF\xFE") || head.starts_with(b"\xFE\xFF") {
            return Err(NotATable::Utf16);
        }
        // First without early ends, so that many bytes are looked at together.
        let is_odd = head.iter().fold(false, |found, b| found | is_binary(*b));
        if is_odd && let Some(offset) = head.iter().position(|&b| is_binary(b)) {
            return Err(no_text_at(head, offset));
        }
        if let Err(e) = std::str::from_utf8(head) {
            // A character may be cut at the end of the head, not at the end of the file.
            if whole || e.error_len().is_some() {
                return Err(no_text_at(head, e.valid_up_to()));
            }
        }
        let byte_order_mark = head.starts_with(BYTE_ORDER_MARK);
        let text = if byte_order_mark { &head[3..] } else { head };
        let line_end = match text.iter().position(|&b| b == b'\n' || b == b'\r') {
            Some(i) if text[i] == b'\r' && text.get(i + 1) == Some(&b'\n') => LineEnd::CrLf,
            Some(i) if text[i] == b'\r' && !text.contains(&b'\n') => LineEnd::Cr,
            _ => LineEnd::Lf,
        };
        let mut lines = text
            .split(|&b| b == b'\n' || b == b'\r')
            .filter(|line| !is_skipped(line));
        let header = lines.next().ok_or(NotATable::Empty)?;
        let delimiter = if header.contains(&b'\t') {
            Delimiter::Tab
        } else if header.contains(&b';') {
            Delimiter::Semicolon
        } else {
            Delimiter::Comma
        };
        let decimal = if delimiter == Delimiter::Comma {
            Decimal::Point
        } else {
            Decimal::Undecided
        };
        Ok(Self {
            byte_order_mark,
            line_end,
            delimiter,
            decimal,
            is_parquet: false,
        })
    }

    /// That of a Parquet file.
    #[cfg(feature = "parquet")]
    pub(super) const fn parquet() -> Self {
        Self {
            byte_order_mark: false,
            line_end: LineEnd::Lf,
            delimiter: Delimiter::Comma,
            decimal: Decimal::Point,
            is_parquet: true,
        }
    }
}

/// Where the byte at an offset stands.
fn no_text_at(head: &[u8], offset: usize) -> NotATable {
    let before = head[..offset].strip_prefix(BYTE_ORDER_MARK);
    let before = String::from_utf8_lossy(before.unwrap_or(&head[..offset]));
    let end = if before.contains('\n') { '\n' } else { '\r' };
    let line = before.rsplit(end).next().unwrap_or_default();
    NotATable::Binary {
        line: before.matches(end).count() + 1,
        column: line.chars().count() + 1,
        byte: head[offset],
    }
}

/// A control character that no text file holds.
pub(super) const fn is_binary(byte: u8) -> bool {
    (byte < b' ')
        & (byte != b'\t')
        & (byte != b'\n')
        & (byte != b'\r')
        & (byte != 0x0C)
        & (byte != 0x1A)
}

/// Blank lines, comments, and the empty rows that spreadsheets leave: nothing but separators.
pub(super) fn is_skipped(line: &[u8]) -> bool {
    let nothing = |b: &u8| matches!(b, b',' | b';') || b.is_ascii_whitespace();
    match line.trim_ascii().first() {
        None | Some(b'#') => true,
        Some(b',' | b';') => line.iter().all(nothing),
        Some(_) => false,
    }
}
