//! Reading a table row by row: any dialect, any length, every error with its line and column.
//!
//! Lines are read here and fields split by `csv-core`, so that the line at hand, its number and the
//! place of every field are known whatever comments and blank lines came before. Memory is one line.

mod column;
mod lines;
mod row;
mod trouble;

use std::cell::Cell;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

use super::columns::ColumnMap;
use super::dialect::{BYTE_ORDER_MARK, Decimal, Delimiter, Dialect, NotATable};
use super::message::{Message, Place, list, nearest};
use super::source::Source;
pub use column::Column;
use column::Heading;
pub(super) use column::Unit;
pub use row::Row;
use trouble::{cannot_read, count, not_a_table, place_of_field};

/// What is read ahead to detect the dialect, in bytes.
const HEAD: u64 = 1 << 16;

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
    headings: Vec<Heading>,
    map: ColumnMap,
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
        let mut file = Source::open(path).map_err(unreadable)?;
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
            headings: Vec::new(),
            map: ColumnMap::default(),
            header: String::new(),
            header_number: 0,
        };
        table.read_header()?;
        Ok(table)
    }

    /// The same where columns have other names and units than the documentation gives them: from here on
    /// they go by what they hold, and columns that `map` does not name are not there.
    ///
    /// # Errors
    /// As [`open`](Self::open); a column of `map` that the file does not have.
    pub fn open_as(path: &Path, map: &ColumnMap) -> Result<Self, Message> {
        let mut table = Self::open(path)?;
        if map.is_empty() {
            return Ok(table);
        }
        let not_read = Heading {
            name: String::new(),
            unit: None,
        };
        let mut headings = vec![not_read; table.names.len()];
        for entry in map.entries() {
            let column = table.column(&entry.column)?;
            let index = column.index();
            if !headings[index].name.is_empty() {
                return Err(table
                    .at_column(
                        &column,
                        format!("column `{}` is given two roles", entry.column),
                    )
                    .remedy("give each column one role"));
            }
            headings[index] = Heading {
                name: entry.role.clone(),
                unit: entry.unit.or(table.headings[index].unit),
            };
        }
        table.headings = headings;
        table.map = map.clone();
        Ok(table)
    }

    /// The columns that are not read, since others were named in their place.
    pub fn ignored(&self) -> Vec<String> {
        let columns = self.names().zip(self.bare_names());
        let ignored = columns.filter(|(_, bare)| bare.is_empty());
        ignored.map(|(name, _)| name.to_owned()).collect()
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
        self.headings = names.iter().map(|name| Heading::of(name)).collect();
        self.names = names;
        Ok(())
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The line that names the columns, as it stands in the file.
    pub fn header(&self) -> &str {
        &self.header
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

    /// What the columns hold: their names without the units that some of them carry, or their roles; empty
    /// for columns that are not read.
    pub fn bare_names(&self) -> impl Iterator<Item = &str> {
        self.headings.iter().map(|heading| heading.name.as_str())
    }

    /// A column that may be absent: one of this name, or of this name with a unit, `x (mm)`, `x [mm]` or
    /// `x_mm`.
    pub fn optional(&self, name: &str) -> Option<Column> {
        let as_written = self
            .names
            .iter()
            .position(|n| n == name && self.map.is_empty());
        let index = as_written.or_else(|| self.bare_names().position(|n| n == name))?;
        Some(Column::new(index, name, self.headings.get(index)?.unit))
    }

    /// A column that must be there.
    ///
    /// # Errors
    /// The column is missing; the message names the nearest that is there.
    pub fn column(&self, name: &str) -> Result<Column, Message> {
        self.optional(name).ok_or_else(|| {
            let found = self.names().collect::<Vec<_>>();
            if !self.map.is_empty() {
                return self
                    .in_header(0, format!("no column is given for `{name}`"))
                    .remedy(format!(
                        "add {name}=COLUMN to the names of the columns; the file has {}",
                        list(&found)
                    ));
            }
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
    /// A column that is none of `known`; the message names the nearest that is. Where columns were given
    /// roles: a role that is none of `known`.
    pub fn only(&self, known: &[&str]) -> Result<(), Message> {
        if !self.map.is_empty() {
            let refuse = |(what, remedy): (String, String)| self.in_header(0, what).remedy(remedy);
            return self.map.only(known).map_err(refuse);
        }
        for (i, (name, bare)) in self.names().zip(self.bare_names()).enumerate() {
            if self.bare_names().take(i).any(|before| before == bare) && known.contains(&bare) {
                return Err(self
                    .in_header(i, format!("column `{bare}` is named twice"))
                    .remedy("keep one of the two, or rename one"));
            }
            if !known.contains(&name) && !known.contains(&bare) {
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
        self.in_header(column.index(), what)
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
}
