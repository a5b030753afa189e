//! The readings of a file without what effects change in them: the same columns, units and rows.

use std::ops::Range;
use std::path::Path;

use super::data::{Readings, channel_of, find_columns};
use super::designs::wide_columns;
use super::setup::ReversalSetup;
use crate::io::dialect::{BYTE_ORDER_MARK, Decimal, Dialect, LineEnd};
use crate::io::units::LengthUnit;
use crate::io::{Column, ColumnMap, Message, Row, TableReader};

/// The table of `path` with `changes` (µm, one a reading in the order of the file) taken out of its
/// readings, below a comment. Every other field stays as it is; comments and blank lines of the file are
/// left out. `dialect` is how the whole file is written.
///
/// # Errors
/// The file cannot be read again, or is no longer what it was.
pub fn corrected(
    path: &Path,
    map: &ColumnMap,
    dialect: Dialect,
    changes: &[f64],
    comment: &str,
) -> Result<Vec<u8>, Message> {
    let table = TableReader::open_as(path, map)?;
    let columns = find_columns(&table)?;
    let scales = columns.scales.reading_um;
    rewritten(table, path, dialect, changes, comment, |row| {
        Ok(match &columns.readings {
            Readings::Tidy { channel, reading } => {
                vec![(reading, scales[channel_of(row, channel)?.index()])]
            }
            Readings::Wide(wide) => {
                let read = wide.iter().filter(|(_, column)| !row.is_empty(column));
                read.map(|(channel, column)| (column, scales[channel.index()]))
                    .collect()
            }
        })
    })
}

/// The same of a design.
///
/// # Errors
/// As [`corrected`].
pub fn corrected_design(
    path: &Path,
    setup: &ReversalSetup,
    dialect: Dialect,
    changes: &[f64],
    comment: &str,
) -> Result<Vec<u8>, Message> {
    let table = TableReader::open_as(path, &setup.columns)?;
    let wide = wide_columns(&table, setup);
    if !wide.is_empty() {
        return rewritten(table, path, dialect, changes, comment, |row| {
            let read = wide.iter().filter(|(_, c, _)| !row.is_empty(c));
            Ok(read.map(|(_, column, in_um)| (column, *in_um)).collect())
        });
    }
    let reading = table.column("reading")?;
    let in_um = reading.length_unit().unwrap_or(LengthUnit::Um).in_um();
    let reading = reading.as_written();
    rewritten(table, path, dialect, changes, comment, |_| {
        Ok(vec![(&reading, in_um)])
    })
}

/// A table with changes taken out of the fields that are told for each row, each with its unit in µm.
fn rewritten<'c>(
    mut table: TableReader,
    path: &Path,
    dialect: Dialect,
    changes: &[f64],
    comment: &str,
    fields: impl Fn(Row<'_>) -> Result<Vec<(&'c Column, f64)>, Message>,
) -> Result<Vec<u8>, Message> {
    let end = match dialect.line_end {
        LineEnd::Lf => "\n",
        LineEnd::CrLf => "\r\n",
        LineEnd::Cr => "\r",
    };
    let mut text = format!("# {comment}{end}{}{end}", table.header());
    let mut left = changes.iter();
    while let Some(row) = table.next_row()? {
        let fields = fields(row)?;
        let mut values = Vec::with_capacity(fields.len());
        for (column, unit) in fields {
            let Some(change) = left.next() else {
                return Err(changed(path));
            };
            values.push((column.index(), row.number(column)? - change / unit));
        }
        let delimiter = dialect.delimiter.byte();
        text += &with_values(&row.line_text(), delimiter, &values, dialect.decimal);
        text += end;
    }
    if left.next().is_some() {
        return Err(changed(path));
    }
    let mark: &[u8] = if dialect.byte_order_mark {
        BYTE_ORDER_MARK
    } else {
        &[]
    };
    Ok([mark, text.as_bytes()].concat())
}

fn changed(path: &Path) -> Message {
    Message::bad_input("has not the readings any more that were just read from it")
        .in_file(path)
        .remedy("give --corrected a file of its own, and data from a file rather than a pipe")
}

/// A line with other numbers in some of its fields.
fn with_values(line: &str, delimiter: u8, values: &[(usize, f64)], decimal: Decimal) -> String {
    let mut text = String::with_capacity(line.len() + 16);
    for (k, range) in fields(line, delimiter).into_iter().enumerate() {
        if k > 0 {
            text.push(char::from(delimiter));
        }
        match values.iter().find(|(index, _)| *index == k) {
            Some((_, value)) => {
                let number = value.to_string();
                text += &match decimal {
                    Decimal::Comma => number.replace('.', ","),
                    Decimal::Point | Decimal::Undecided => number,
                };
            }
            None => text += &line[range],
        }
    }
    text
}

/// Where the fields of a line stand, their quotes included.
fn fields(line: &str, delimiter: u8) -> Vec<Range<usize>> {
    let (mut fields, mut start, mut quoted) = (Vec::new(), 0, false);
    for (i, byte) in line.bytes().enumerate() {
        if byte == b'"' {
            quoted = !quoted;
        } else if byte == delimiter && !quoted {
            fields.push(start..i);
            start = i + 1;
        }
    }
    fields.push(start..line.len());
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_readings_change() {
        let line = "1A;1;\"a;b\"; 2,5 ;x";
        let text = with_values(line, b';', &[(3, -1.25)], Decimal::Comma);
        assert_eq!(text, "1A;1;\"a;b\";-1,25;x");
    }
}
