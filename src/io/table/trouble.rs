//! Where a field stands, and what is wrong with a file that is no table.

use std::path::Path;

use crate::io::dialect::{Delimiter, NotATable};
use crate::io::message::{Message, Place};

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

pub(super) fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
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
        NotATable::Binary { offset, byte } => (
            format!("the file is not text: byte {} is 0x{byte:02X}", offset + 1),
            "export it as plain text (CSV, UTF-8)",
        ),
    };
    Message::bad_input(what)
        .at(Place {
            file: path.to_owned(),
            line: 1,
            column: 1,
            text: String::new(),
            length: 0,
        })
        .remedy(remedy)
}
