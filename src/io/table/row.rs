//! One row: texts, numbers and counts of its fields, and messages that point at them.

use std::borrow::Cow;
use std::cell::Cell;

use super::Column;
#[cfg(feature = "parquet")]
use super::parquet::Batch;
use super::sheet::Sheet;
use super::trouble::place_of_field;
use crate::io::dialect::{Decimal, Delimiter};
use crate::io::message::{Message, Place};

/// One row of a table.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    sheet: &'a Sheet,
    decimal: &'a Cell<Decimal>,
    cells: Cells<'a>,
    number: usize,
}

/// What stands in a row.
#[derive(Clone, Copy)]
pub(super) enum Cells<'a> {
    /// A line of text.
    Line {
        /// The line as it stands in the file, without its end.
        line: &'a [u8],
        /// Where its fields stand, the first from `start` to the first of `ends`, with `between` bytes from
        /// the end of one to the start of the next.
        fields: &'a [u8],
        start: usize,
        ends: &'a [u32],
        between: usize,
    },
    /// A row of a Parquet file.
    #[cfg(feature = "parquet")]
    Columns(&'a Batch, usize),
}

impl<'a> Row<'a> {
    pub(super) fn new(
        sheet: &'a Sheet,
        decimal: &'a Cell<Decimal>,
        cells: Cells<'a>,
        number: usize,
    ) -> Self {
        Self {
            sheet,
            decimal,
            cells,
            number,
        }
    }

    /// Its line in the file, from 1; in a Parquet file the number of the row.
    pub fn line(self) -> usize {
        self.number
    }

    /// The line as it stands in the file, without its end; of a Parquet file, as a table would have it.
    pub fn line_text(self) -> Cow<'a, str> {
        match self.cells {
            Cells::Line { line, .. } => String::from_utf8_lossy(line),
            #[cfg(feature = "parquet")]
            Cells::Columns(batch, row) => Cow::Owned(batch.line(row)),
        }
    }

    pub(super) fn field_count(self) -> usize {
        match self.cells {
            Cells::Line { ends, .. } => ends.len(),
            #[cfg(feature = "parquet")]
            Cells::Columns(batch, _) => batch.column_count(),
        }
    }

    /// A field with the blanks around it.
    fn bytes(self, index: usize) -> &'a [u8] {
        let (start, ends, between, fields) = match self.cells {
            Cells::Line {
                fields,
                start,
                ends,
                between,
                ..
            } => (start, ends, between, fields),
            #[cfg(feature = "parquet")]
            Cells::Columns(batch, row) => return batch.text(row, index).as_bytes(),
        };
        let start = match index.checked_sub(1).and_then(|before| ends.get(before)) {
            Some(end) => *end as usize + between,
            None => start,
        };
        let end = ends.get(index).map(|end| *end as usize);
        let field = end.and_then(|end| fields.get(start..end));
        field.unwrap_or_default()
    }

    pub(super) fn field(self, index: usize) -> &'a str {
        let bytes = self.bytes(index);
        let text = std::str::from_utf8(bytes).unwrap_or("");
        if is_bare(bytes) { text } else { text.trim() }
    }

    /// Whether a field is empty but for blanks.
    pub(super) fn is_blank(self, index: usize) -> bool {
        #[cfg(feature = "parquet")]
        if let Cells::Columns(batch, row) = self.cells
            && let Some(value) = batch.number(row, index)
        {
            return value.is_nan();
        }
        !is_bare(self.bytes(index)) && self.field(index).is_empty()
    }

    /// Which of these names, without blanks, stands in a field.
    pub fn one_of(self, column: &Column, names: &[&str]) -> Option<usize> {
        let bytes = self.bytes(column.index()).trim_ascii();
        names.iter().position(|name| name.as_bytes() == bytes)
    }

    /// Whether a field is empty.
    pub fn is_empty(self, column: &Column) -> bool {
        self.is_blank(column.index())
    }

    /// The text of a field, without the blanks around it.
    pub fn text(self, column: &Column) -> &'a str {
        self.field(column.index())
    }

    /// The finite number in a field.
    ///
    /// # Errors
    /// The field is empty, is no number, or is not finite.
    pub fn number(self, column: &Column) -> Result<f64, Message> {
        #[cfg(feature = "parquet")]
        if let Cells::Columns(batch, row) = self.cells
            && let Some(value) = batch.number(row, column.index())
            && let Some(scale) = column.scale()
            && (scale * value).is_finite()
        {
            return Ok(scale * value);
        }
        let bytes = self.bytes(column.index());
        if self.sheet.dialect.delimiter == Delimiter::Comma
            && let Some(scale) = column.scale()
            && let Ok(value) = fast_float2::parse::<f64, _>(bytes)
            && (scale * value).is_finite()
        {
            return Ok(scale * value);
        }
        self.any_number(column)
    }

    /// The number in a field that may have blanks around it, or no number.
    fn any_number(self, column: &Column) -> Result<f64, Message> {
        let text = self.field(column.index());
        let name = column.name();
        if text.is_empty() {
            return Err(self
                .error(column, format!("{name} is missing: the field is empty"))
                .remedy("write the number, or remove the row"));
        }
        let Some(scale) = column.scale() else {
            return Err(self
                .sheet
                .at_column(column, format!("`{name}` is not taken in other units"))
                .remedy(format!("convert it, and name the column `{name}`")));
        };
        let value = scale * self.parse(column, text)?;
        if value.is_finite() {
            return Ok(value);
        }
        Err(self
            .error(column, format!("{name} is \"{text}\", not a finite number"))
            .remedy("write the number, or remove the row"))
    }

    fn parse(self, column: &Column, written: &str) -> Result<f64, Message> {
        let name = column.name();
        // The minus sign of typography stands in what our own reports print and spreadsheets show.
        let text = &written.replace('\u{2212}', "-");
        let decimal = self.decimal.get();
        if self.sheet.dialect.delimiter == Delimiter::Comma {
            if let Ok(value) = text.parse() {
                return Ok(value);
            }
        } else {
            let mark = match (text.contains(','), text.contains('.')) {
                (true, false) => Decimal::Comma,
                (false, true) => Decimal::Point,
                (false, false) => decimal,
                (true, true) => {
                    return Err(self
                        .error(column, format!("{name} \"{text}\" has a comma and a point"))
                        .remedy("write numbers without separators between the thousands"));
                }
            };
            if let Ok(value) = text.replace(',', ".").parse() {
                if decimal == Decimal::Undecided {
                    self.decimal.set(mark);
                } else if mark != decimal {
                    let used = match decimal {
                        Decimal::Comma => "a decimal comma",
                        Decimal::Point | Decimal::Undecided => "a decimal point",
                    };
                    return Err(self
                        .error(column, format!("{name} \"{text}\" mixes decimal marks"))
                        .remedy(format!(
                            "the rows before use {used}: use one mark throughout"
                        )));
                }
                return Ok(value);
            }
        }
        let remedy = if name == "time" && is_clock(text) {
            "write the seconds since the first reading, such as 12.5, not the time of day"
        } else {
            "write a plain number such as 1.25, without unit or text"
        };
        Err(self
            .error(column, format!("{name} \"{written}\" is not a number"))
            .remedy(remedy))
    }

    /// The whole number from 1 in a field.
    ///
    /// # Errors
    /// The field holds something else.
    pub fn count(self, column: &Column) -> Result<u32, Message> {
        #[cfg(feature = "parquet")]
        if let Cells::Columns(batch, row) = self.cells
            && let Some(value) = batch.number(row, column.index())
            && value >= 1.0
            && value <= f64::from(u32::MAX)
            && value.fract() == 0.0
        {
            return Ok(value as u32);
        }
        if let [digit @ b'1'..=b'9'] = self.bytes(column.index()) {
            return Ok(u32::from(digit - b'0'));
        }
        let text = self.field(column.index());
        match text.parse() {
            Ok(n) if n > 0 => Ok(n),
            _ => Err(self
                .error(
                    column,
                    format!("{} \"{text}\" is not a whole number from 1", column.name()),
                )
                .remedy("write 1, 2, 3, …")),
        }
    }

    /// A message about a field of this row.
    pub fn error(self, column: &Column, what: impl Into<String>) -> Message {
        self.bad(column.index(), what)
    }

    /// Where a field of this row stands.
    pub fn place(self, column: &Column) -> Place {
        self.place_of(column.index())
    }

    fn place_of(self, index: usize) -> Place {
        let line = self.line_text();
        let delimiter = self.sheet.dialect.delimiter;
        place_of_field(&self.sheet.path, self.number, &line, delimiter, index)
    }

    pub(super) fn bad(self, index: usize, what: impl Into<String>) -> Message {
        Message::bad_input(what).at(self.place_of(index))
    }
}

/// Whether a text is a time of day or a date: 08:00:00, 2026-11-29T08:00.
fn is_clock(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit())
        && (text.contains(':') || text.matches(['-', '/']).count() == 2)
}

/// Whether there are no blanks around a field, and something in it.
fn is_bare(field: &[u8]) -> bool {
    matches!(field, [b'!'..=b'~'] | [b'!'..=b'~', .., b'!'..=b'~'])
}
