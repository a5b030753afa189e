//! Where a field stands, and what is wrong with a file that is no table.

use std::path::Path;

use super::row::Row;
use super::sheet::Sheet;
use crate::io::dialect::{Delimiter, NotATable};
use crate::io::message::{Message, Place};
use crate::number::counted;

/// Where a field stands in its line as written (quotes included).
pub(super) fn place_of_field(
    path: &Path,
    number: usize,
    line: &str,
    delimiter: Delimiter,
    index: usize,
) -> Place {
    let mut quoted = false;
    let mut field = 0;
    let (mut start, mut end) = (0, line.len());
    for (i, b) in line.bytes().enumerate() {
        if b == b'"' {
            quoted = !quoted;
        } else if b == delimiter.byte() && !quoted {
            if field == index {
                end = i;
                break;
            }
            field += 1;
            start = i + 1;
        }
    }
    Place {
        file: path.to_owned(),
        line: number,
        column: line[..start].chars().count() + 1,
        text: line.to_owned(),
        length: end - start,
    }
}

pub(super) fn cannot_read(path: &Path, error: &std::io::Error) -> Message {
    let remedy = match error.kind() {
        std::io::ErrorKind::NotFound => "check the name and the folder",
        std::io::ErrorKind::PermissionDenied => "check who may read it",
        _ => "give the name of a readable file",
    };
    Message::bad_input(format!("the file cannot be read: {error}"))
        .in_file(path)
        .remedy(remedy)
}

pub(super) fn not_a_table(path: &Path, why: NotATable) -> Message {
    let (what, remedy) = match why {
        NotATable::Empty => (
            "the file is empty".to_owned(),
            "write a first line that names the columns and the data below it",
        ),
        NotATable::Utf16 => (
            "the file is UTF-16".to_owned(),
            "save it again as UTF-8 (\"CSV UTF-8\" in a spreadsheet)",
        ),
        NotATable::Binary { byte, .. } => (
            format!("the file is not text: this byte is 0x{byte:02X}"),
            remedy_of(byte),
        ),
    };
    let (line, column) = match why {
        NotATable::Binary { line, column, .. } => (line, column),
        NotATable::Empty | NotATable::Utf16 => (1, 1),
    };
    Message::bad_input(what)
        .at(Place {
            file: path.to_owned(),
            line,
            column,
            text: String::new(),
            length: 0,
        })
        .remedy(remedy)
}

/// What to do about a byte that is not text: that of a letter in an older encoding, or of no text at all.
fn remedy_of(byte: u8) -> &'static str {
    if byte >= 0x80 {
        "save the file as UTF-8 (\"CSV UTF-8\" in a spreadsheet): an older encoding such as Latin-1 has letters like µ there"
    } else {
        "export it as plain text (CSV, UTF-8)"
    }
}

/// A line with a byte that is not text.
pub(super) fn no_text(sheet: &Sheet, number: usize, line: &[u8], byte: usize) -> Message {
    let what = format!("this byte (0x{:02X}) is not text", line[byte]);
    Message::bad_input(what)
        .at(Place {
            file: sheet.path.clone(),
            line: number,
            column: String::from_utf8_lossy(&line[..byte]).chars().count() + 1,
            text: String::new(),
            length: 0,
        })
        .remedy(remedy_of(line[byte]))
}

/// A line whose quote does not end on it.
pub(super) fn open_quote(sheet: &Sheet, number: usize, line: &[u8]) -> Message {
    let text = String::from_utf8_lossy(line).into_owned();
    let quote = text.rfind('"').unwrap_or(0);
    Message::bad_input("a quote is opened and not closed on this line")
        .at(Place {
            file: sheet.path.clone(),
            line: number,
            column: text[..quote].chars().count() + 1,
            text,
            length: 1,
        })
        .remedy("close the quote, or remove it")
}

/// A row with another number of fields than the table has columns.
pub(super) fn wrong_count(sheet: &Sheet, row: Row<'_>, found: usize) -> Message {
    let expected = sheet.names.len();
    let what = format!(
        "the row has {}, the first line names {}",
        counted(found, "field"),
        counted(expected, "column")
    );
    let remedy = match sheet.dialect.delimiter {
        Delimiter::Comma => {
            "give every row one field a column; \
             write decimals with a point, or separate fields by `;`"
        }
        _ => "give every row one field a column",
    };
    row.bad(expected.min(found.saturating_sub(1)), what)
        .remedy(remedy)
}
