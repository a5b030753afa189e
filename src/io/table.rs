//! Reading a table row by row: any dialect, any length, every error with its line and column.
//!
//! Lines are read here and fields split by `csv-core`, so that the line at hand, its number and the
//! place of every field are known whatever comments and blank lines came before. Memory is one line.

use std::cell::Cell;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

use csv_core::ReadRecordResult;

use super::dialect::{
    BYTE_ORDER_MARK, Decimal, Delimiter, Dialect, LineEnd, NotATable, is_skipped,
};
use super::message::{Message, Place, list, nearest};

/// What is read ahead to detect the dialect, in bytes.
const HEAD: u64 = 1 << 16;
/// A longer line is not that of a table, in bytes.
const LONGEST_LINE: u64 = 1 << 20;

/// A column of a table, found by its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    index: usize,
    name: String,
}

impl Column {
    /// Its name in the file.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// A table being read, row by row.
pub struct TableReader {
    path: PathBuf,
    source: Box<dyn BufRead + Send>,
    dialect: Dialect,
    decimal: Cell<Decimal>,
    splitter: csv_core::Reader,
    line: Vec<u8>,
    line_number: usize,
    fields: Vec<u8>,
    ends: Vec<usize>,
    field_count: usize,
    names: Vec<String>,
    header: String,
    header_number: usize,
}

impl TableReader {
    /// Opens a table, detects its dialect and reads the names of its columns.
    ///
    /// # Errors
    /// A file that cannot be read, is empty, is no text, or whose first line does not name columns.
    pub fn open(path: &Path) -> Result<Self, Message> {
        let unreadable = |e: std::io::Error| cannot_read(path, &e);
        let mut file = File::open(path).map_err(unreadable)?;
        let mut head = Vec::new();
        (&mut file)
            .take(HEAD)
            .read_to_end(&mut head)
            .map_err(unreadable)?;
        let whole = (head.len() as u64) < HEAD;
        let dialect = Dialect::detect(&head, whole).map_err(|no| not_a_table(path, no))?;
        let mut start = Cursor::new(head);
        if dialect.byte_order_mark {
            start.set_position(BYTE_ORDER_MARK.len() as u64);
        }
        let mut table = Self {
            path: path.to_owned(),
            source: Box::new(BufReader::with_capacity(1 << 16, start.chain(file))),
            dialect,
            decimal: Cell::new(dialect.decimal),
            splitter: csv_core::ReaderBuilder::new()
                .delimiter(dialect.delimiter.byte())
                .build(),
            line: Vec::new(),
            line_number: 0,
            fields: Vec::new(),
            ends: Vec::new(),
            field_count: 0,
            names: Vec::new(),
            header: String::new(),
            header_number: 0,
        };
        table.read_header()?;
        Ok(table)
    }

    fn read_header(&mut self) -> Result<(), Message> {
        if !self.next_line()? {
            return Err(not_a_table(&self.path, NotATable::Empty));
        }
        let row = Row { table: self };
        let mut names = (0..self.field_count)
            .map(|i| row.field(i).to_owned())
            .collect::<Vec<_>>();
        while names.len() > 1 && names.last().is_some_and(String::is_empty) {
            names.pop();
        }
        let numbers = names
            .iter()
            .filter(|n| n.replace(',', ".").parse::<f64>().is_ok());
        if 2 * numbers.count() > names.len() {
            return Err(row
                .bad(
                    0,
                    "the first line holds numbers, not the names of the columns",
                )
                .remedy("add a first line that names the columns"));
        }
        for (i, name) in names.iter().enumerate() {
            if name.is_empty() {
                return Err(row
                    .bad(i, format!("column {} has no name", i + 1))
                    .remedy("name every column in the first line"));
            }
            if names[..i].contains(name) {
                return Err(row
                    .bad(i, format!("column `{name}` is named twice"))
                    .remedy("keep one of the two, or rename one"));
            }
        }
        self.header = String::from_utf8_lossy(&self.line).into_owned();
        self.header_number = self.line_number;
        self.names = names;
        Ok(())
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How the file is written, as far as it has been read.
    pub fn dialect(&self) -> Dialect {
        Dialect {
            decimal: self.decimal.get(),
            ..self.dialect
        }
    }

    /// The names of the columns, in the order of the file.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// A column that may be absent.
    pub fn optional(&self, name: &str) -> Option<Column> {
        let index = self.names.iter().position(|n| n == name)?;
        Some(Column {
            index,
            name: name.to_owned(),
        })
    }

    /// A column that must be there.
    ///
    /// # Errors
    /// The column is missing; the message names the nearest that is there.
    pub fn column(&self, name: &str) -> Result<Column, Message> {
        self.optional(name).ok_or_else(|| {
            let found = self.names().collect::<Vec<_>>();
            let remedy = match nearest(name, found.iter().copied()) {
                Some(near) => {
                    format!("rename column `{near}` to `{name}` if that is what it holds")
                }
                None => format!("add column `{name}`; the file has {}", list(&found)),
            };
            self.in_header(0, format!("column `{name}` is missing"))
                .remedy(remedy)
        })
    }

    /// Refuses columns that nobody will read.
    ///
    /// # Errors
    /// A column that is none of `known`; the message names the nearest that is.
    pub fn only(&self, known: &[&str]) -> Result<(), Message> {
        for (i, name) in self.names().enumerate() {
            if !known.contains(&name) {
                let remedy = match nearest(name, known.iter().copied()) {
                    Some(near) => {
                        format!("did you mean `{near}`? Columns may be {}", list(known))
                    }
                    None => format!("remove it; columns may be {}", list(known)),
                };
                return Err(self
                    .in_header(i, format!("unknown column `{name}`"))
                    .remedy(remedy));
            }
        }
        Ok(())
    }

    /// A message about a column's name in the first line.
    pub fn in_header(&self, index: usize, what: impl Into<String>) -> Message {
        let place = place_of_field(
            &self.path,
            self.header_number,
            &self.header,
            self.dialect.delimiter,
            index,
        );
        Message::bad_input(what).at(place)
    }

    /// A message about a column.
    pub fn at_column(&self, column: &Column, what: impl Into<String>) -> Message {
        self.in_header(column.index, what)
    }

    /// A message about a row that was read before, known by its line number alone.
    pub fn at_line(&self, line: usize, what: impl Into<String>) -> Message {
        Message::bad_input(what).at(Place {
            file: self.path.clone(),
            line,
            column: 1,
            text: String::new(),
            length: 0,
        })
    }

    /// A message for a table that ends after its first line.
    pub fn no_rows(&self) -> Message {
        Message::bad_input("the file names columns but has no row of data")
            .at(Place {
                file: self.path.clone(),
                line: self.header_number,
                column: 1,
                text: self.header.clone(),
                length: self.header.len(),
            })
            .remedy("add the data below the first line")
    }

    /// The next row; comments and blank lines are passed over. `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read on, or the line is not a row of this table.
    pub fn next_row(&mut self) -> Result<Option<Row<'_>>, Message> {
        if !self.next_line()? {
            return Ok(None);
        }
        let row = Row { table: self };
        let expected = self.names.len();
        let surplus_is_empty = (expected..self.field_count).all(|i| row.field(i).is_empty());
        if self.field_count < expected || !surplus_is_empty {
            let what = format!(
                "the row has {}, the first line names {expected} columns",
                count(self.field_count, "field")
            );
            return Err(row
                .bad(expected.min(self.field_count.saturating_sub(1)), what)
                .remedy(match self.dialect.delimiter {
                    Delimiter::Comma => {
                        "give every row one field a column; \
                         write decimals with a point, or separate fields by `;`"
                    }
                    _ => "give every row one field a column",
                }));
        }
        Ok(Some(row))
    }

    /// Reads and splits the next line that is neither blank nor a comment.
    fn next_line(&mut self) -> Result<bool, Message> {
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
        let wrong = match std::str::from_utf8(&self.line) {
            Err(e) => Some(e.valid_up_to()),
            Ok(_) => self.line.iter().position(|&b| b == 0),
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
}

/// One row of a table.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    table: &'a TableReader,
}

impl<'a> Row<'a> {
    /// Its line in the file, from 1.
    pub fn line(self) -> usize {
        self.table.line_number
    }

    fn field(self, index: usize) -> &'a str {
        let t = self.table;
        let start = match index {
            0 => 0,
            i => t.ends.get(i - 1).copied().unwrap_or(0),
        };
        let end = t.ends.get(index).copied().unwrap_or(start);
        t.fields
            .get(start..end)
            .and_then(|f| std::str::from_utf8(f).ok())
            .unwrap_or("")
            .trim()
    }

    /// The text of a field, without the blanks around it.
    pub fn text(self, column: &Column) -> &'a str {
        self.field(column.index)
    }

    /// The finite number in a field.
    ///
    /// # Errors
    /// The field is empty, is no number, or is not finite.
    pub fn number(self, column: &Column) -> Result<f64, Message> {
        let text = self.field(column.index);
        let name = &column.name;
        if text.is_empty() {
            return Err(self
                .error(column, format!("{name} is missing: the field is empty"))
                .remedy("write the number, or remove the row"));
        }
        let value = self.parse(column, text)?;
        if value.is_finite() {
            return Ok(value);
        }
        Err(self
            .error(column, format!("{name} is \"{text}\", not a finite number"))
            .remedy("write the number, or remove the row"))
    }

    fn parse(self, column: &Column, text: &str) -> Result<f64, Message> {
        let name = &column.name;
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
        let text = self.field(column.index);
        match text.parse() {
            Ok(n) if n > 0 => Ok(n),
            _ => Err(self
                .error(
                    column,
                    format!("{} \"{text}\" is not a whole number from 1", column.name),
                )
                .remedy("write 1, 2, 3, …")),
        }
    }

    /// A message about a field of this row.
    pub fn error(self, column: &Column, what: impl Into<String>) -> Message {
        self.bad(column.index, what)
    }

    /// Where a field of this row stands.
    pub fn place(self, column: &Column) -> Place {
        self.place_of(column.index)
    }

    fn place_of(self, index: usize) -> Place {
        let t = self.table;
        let line = String::from_utf8_lossy(&t.line);
        place_of_field(&t.path, t.line_number, &line, t.dialect.delimiter, index)
    }

    fn bad(self, index: usize, what: impl Into<String>) -> Message {
        Message::bad_input(what).at(self.place_of(index))
    }
}

/// Where a field stands in its line as written (quotes included).
fn place_of_field(
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

fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

fn cannot_read(path: &Path, error: &std::io::Error) -> Message {
    let remedy = match error.kind() {
        std::io::ErrorKind::NotFound => "check the name and the folder",
        std::io::ErrorKind::PermissionDenied => "check who may read it",
        _ => "give the name of a readable file",
    };
    Message::bad_input(format!("the file cannot be read: {error}"))
        .in_file(path)
        .remedy(remedy)
}

fn not_a_table(path: &Path, why: NotATable) -> Message {
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
