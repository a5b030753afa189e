//! One row: texts, numbers and counts of its fields, and messages that point at them.

use super::trouble::place_of_field;
use super::{Column, TableReader};
use crate::io::dialect::{Decimal, Delimiter};
use crate::io::message::{Message, Place};

/// One row of a table.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    pub(super) table: &'a TableReader,
}

impl<'a> Row<'a> {
    /// Its line in the file, from 1.
    pub fn line(self) -> usize {
        self.table.line_number
    }

    /// The line as it stands in the file, without its end.
    pub fn line_text(self) -> &'a str {
        std::str::from_utf8(&self.table.line).unwrap_or("")
    }

    pub(super) fn field(self, index: usize) -> &'a str {
        let t = self.table;
        let start = match index {
            0 => 0,
            i => t.ends.get(i - 1).copied().unwrap_or(0),
        };
        let end = t.ends.get(index).copied().unwrap_or(start);
        let text = t.fields.get(start..end);
        let text = text.and_then(|f| std::str::from_utf8(f).ok()).unwrap_or("");
        match text.as_bytes() {
            // Nothing to take off.
            [b'!'..=b'~'] | [b'!'..=b'~', .., b'!'..=b'~'] => text,
            _ => text.trim(),
        }
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
        let text = self.field(column.index());
        let name = column.name();
        if text.is_empty() {
            return Err(self
                .error(column, format!("{name} is missing: the field is empty"))
                .remedy("write the number, or remove the row"));
        }
        let Some(scale) = column.scale() else {
            return Err(self
                .table
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

    fn parse(self, column: &Column, text: &str) -> Result<f64, Message> {
        let name = column.name();
        let decimal = self.table.decimal.get();
        if self.table.dialect.delimiter == Delimiter::Comma {
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
                    self.table.decimal.set(mark);
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
        Err(self
            .error(column, format!("{name} \"{text}\" is not a number"))
            .remedy("write a plain number such as 1.25, without unit or text"))
    }

    /// The whole number from 1 in a field.
    ///
    /// # Errors
    /// The field holds something else.
    pub fn count(self, column: &Column) -> Result<u32, Message> {
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
        let t = self.table;
        let line = String::from_utf8_lossy(&t.line);
        place_of_field(&t.path, t.line_number, &line, t.dialect.delimiter, index)
    }

    pub(super) fn bad(self, index: usize, what: impl Into<String>) -> Message {
        Message::bad_input(what).at(self.place_of(index))
    }
}
