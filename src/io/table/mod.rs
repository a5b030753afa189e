//! Reading a table row by row: any dialect, any length, every error with its line and column.
//!
//! The file is read in chunks of whole lines (`blocks.rs`). Where a chunk is plain text, as nearly all are, one
//! look at its bytes finds the ends of all its fields (`chunk.rs`); quotes and other alphabets are split line by
//! line by `csv-core`. The line at hand, its number and the place of every field are known whatever comments and
//! blank lines came before. Rows come one after the other (`next_row`), or several chunks are worked at at once
//! while the next ones are read and hashed (`gather.rs`). Memory is that of some chunks.

mod blocks;
mod chunk;
mod column;
mod gather;
#[cfg(feature = "parquet")]
mod parquet;
mod row;
mod sheet;
mod trouble;

use std::cell::Cell;
use std::io::Read;
use std::path::Path;

use super::columns::ColumnMap;
use super::dialect::{BYTE_ORDER_MARK, Decimal, Dialect, NotATable};
use super::message::{Message, Place, list, nearest};
use super::source::Source;
use blocks::Blocks;
use chunk::{Chunk, Walk, complete};
pub use column::Column;
use column::Heading;
pub(super) use column::Unit;
pub use row::Row;
use sheet::Sheet;
use trouble::{cannot_read, not_a_table};

/// What is read ahead to detect the dialect, in bytes.
const HEAD: usize = 1 << 16;

/// A table being read, row by row.
pub struct TableReader {
    sheet: Sheet,
    decimal: Cell<Decimal>,
    rows: Rows,
}

/// Where rows come from.
enum Rows {
    Text(Box<Text>),
    #[cfg(feature = "parquet")]
    Parquet(Box<parquet::Columns>),
}

/// A text in chunks, and the walk through the one at hand.
struct Text {
    blocks: Blocks,
    chunk: Chunk,
    walk: Walk,
}

/// The beginning of a file: all of it, if it is shorter than [`HEAD`].
fn read_head(file: &mut Source) -> std::io::Result<Vec<u8>> {
    let length = file.length().map_or(HEAD as u64, |n| n.saturating_add(1));
    let mut head = vec![0; length.min(HEAD as u64) as usize];
    let mut filled = 0;
    loop {
        if filled == HEAD {
            return Ok(head);
        }
        if filled == head.len() {
            head.resize(HEAD, 0);
        }
        match file.read(&mut head[filled..]) {
            Ok(0) => {
                head.truncate(filled);
                return Ok(head);
            }
            Ok(n) => filled += n,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
}

impl TableReader {
    /// Opens a table, detects its dialect and reads the names of its columns.
    ///
    /// # Errors
    /// A file that cannot be read, is empty, is no text, or whose first line does not name columns.
    pub fn open(path: &Path) -> Result<Self, Message> {
        if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("parquet"))
        {
            return Self::open_parquet(path);
        }
        let unreadable = |e: std::io::Error| cannot_read(path, &e);
        let mut file = Source::open(path).map_err(unreadable)?;
        let mut head = read_head(&mut file).map_err(unreadable)?;
        let whole = head.len() < HEAD;
        let dialect = Dialect::detect(&head, whole).map_err(|no| not_a_table(path, no))?;
        if dialect.byte_order_mark {
            head.drain(..BYTE_ORDER_MARK.len());
        }
        let mut table = Self {
            sheet: Sheet {
                path: path.to_owned(),
                dialect,
                names: Vec::new(),
                headings: Vec::new(),
                map: ColumnMap::default(),
                renamable: false,
                header: String::new(),
                header_number: 0,
            },
            decimal: Cell::new(dialect.decimal),
            rows: Rows::Text(Box::new(Text {
                blocks: Blocks::new(file, head, dialect.line_end.last_byte()),
                chunk: Chunk::default(),
                walk: Walk::default(),
            })),
        };
        table.read_header()?;
        Ok(table)
    }

    #[cfg(feature = "parquet")]
    fn open_parquet(path: &Path) -> Result<Self, Message> {
        let (columns, names) = parquet::Columns::open(path)?;
        let dialect = Dialect::parquet();
        let sheet = Sheet {
            path: path.to_owned(),
            dialect,
            headings: names.iter().map(|name| Heading::of(name)).collect(),
            map: ColumnMap::default(),
            renamable: false,
            header: names.join(","),
            header_number: 0,
            names,
        };
        Ok(Self {
            sheet,
            decimal: Cell::new(dialect.decimal),
            rows: Rows::Parquet(Box::new(columns)),
        })
    }

    #[cfg(not(feature = "parquet"))]
    fn open_parquet(path: &Path) -> Result<Self, Message> {
        Err(Message::bad_input("this errsep was built without Parquet")
            .in_file(path)
            .remedy(
                "give the readings as CSV; or build errsep with it: \
                     cargo install --path . --features parquet",
            ))
    }

    /// The same where columns have other names and units than the documentation gives them: from here on
    /// they go by what they hold, and columns that `map` does not name are not there.
    ///
    /// # Errors
    /// As [`open`](Self::open); a column of `map` that the file does not have.
    pub fn open_as(path: &Path, map: &ColumnMap) -> Result<Self, Message> {
        let mut table = Self::open(path)?;
        table.sheet.renamable = true;
        if map.is_empty() {
            return Ok(table);
        }
        let not_read = Heading {
            name: String::new(),
            unit: None,
        };
        let mut headings = vec![not_read; table.sheet.names.len()];
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
                unit: entry.unit.or(table.sheet.headings[index].unit),
            };
        }
        table.sheet.headings = headings;
        table.sheet.map = map.clone();
        Ok(table)
    }

    /// The columns that are not read, since others were named in their place.
    pub fn ignored(&self) -> Vec<String> {
        let columns = self.names().zip(self.bare_names());
        let ignored = columns.filter(|(_, bare)| bare.is_empty());
        ignored.map(|(name, _)| name.to_owned()).collect()
    }

    fn read_header(&mut self) -> Result<(), Message> {
        let Some(row) = self.next_line()? else {
            return Err(not_a_table(self.path(), NotATable::Empty));
        };
        let mut names = (0..row.field_count())
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
        let (header, number) = (row.line_text().into_owned(), row.line());
        self.sheet.header = header;
        self.sheet.header_number = number;
        self.sheet.headings = names.iter().map(|name| Heading::of(name)).collect();
        self.sheet.names = names;
        Ok(())
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.sheet.path
    }

    /// The line that names the columns, as it stands in the file.
    pub fn header(&self) -> &str {
        &self.sheet.header
    }

    /// How the file is written, as far as it has been read.
    pub fn dialect(&self) -> Dialect {
        Dialect {
            decimal: self.decimal.get(),
            ..self.sheet.dialect
        }
    }

    /// The names of the columns, in the order of the file.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.sheet.names.iter().map(String::as_str)
    }

    /// What the columns hold: their names without the units that some of them carry, or their roles; empty
    /// for columns that are not read.
    pub fn bare_names(&self) -> impl Iterator<Item = &str> {
        self.sheet
            .headings
            .iter()
            .map(|heading| heading.name.as_str())
    }

    /// A column that may be absent: one of this name, or of this name with a unit, `x (mm)`, `x [mm]` or
    /// `x_mm`; capitals count only where two columns differ in nothing else.
    pub fn optional(&self, name: &str) -> Option<Column> {
        let as_written = self
            .sheet
            .names
            .iter()
            .position(|n| n == name && self.sheet.map.is_empty());
        let same = |n: &str| n.eq_ignore_ascii_case(name);
        let index = as_written
            .or_else(|| self.bare_names().position(|n| n == name))
            .or_else(|| self.bare_names().position(same))?;
        Some(Column::new(
            index,
            name,
            self.sheet.headings.get(index)?.unit,
        ))
    }

    /// A column that must be there.
    ///
    /// # Errors
    /// The column is missing; the message names the nearest that is there.
    pub fn column(&self, name: &str) -> Result<Column, Message> {
        self.optional(name).ok_or_else(|| {
            let found = self.names().collect::<Vec<_>>();
            if !self.sheet.map.is_empty() {
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
        if !self.sheet.map.is_empty() {
            let refuse = |(what, remedy): (String, String)| self.in_header(0, what).remedy(remedy);
            return self.sheet.map.only(known).map_err(refuse);
        }
        let columns: Vec<Option<&str>> = self
            .names()
            .zip(self.bare_names())
            .map(|(name, bare)| meant(&[name, bare], known))
            .collect();
        for (i, (name, column)) in self.names().zip(&columns).enumerate() {
            let Some(column) = column else {
                return Err(self.unknown_column(i, name, &columns, known));
            };
            if columns[..i].contains(&Some(column)) {
                return Err(self
                    .in_header(i, format!("column `{column}` is named twice"))
                    .remedy("keep one of the two, or rename one"));
            }
        }
        Ok(())
    }

    /// A message about a column that is none of `known`; `columns`: which each of the file is.
    fn unknown_column(
        &self,
        index: usize,
        name: &str,
        columns: &[Option<&str>],
        known: &[&str],
    ) -> Message {
        let near = nearest(name, known.iter().copied());
        let mut remedy = match near {
            Some(near) => format!("did you mean `{near}`? Columns may be {}", list(known)),
            None => format!("remove it; columns may be {}", list(known)),
        };
        if columns.iter().all(Option::is_none) {
            remedy += ". If lines stand before the one that names the columns, remove them or begin them with #";
        }
        let role = near.or_else(|| {
            let mut absent = known.iter().filter(|k| !columns.contains(&Some(**k)));
            absent.next().copied()
        });
        if let Some(role) = role.filter(|_| self.sheet.renamable) {
            remedy += &format!(
                ". Columns of other names are read with --columns ROLE=COLUMN,…, such as {role}={name}, which names every column that is to be read"
            );
        }
        self.in_header(index, format!("unknown column `{name}`"))
            .remedy(remedy)
    }

    /// A message about a column's name in the first line.
    pub fn in_header(&self, index: usize, what: impl Into<String>) -> Message {
        self.sheet.in_header(index, what)
    }

    /// A message about a column.
    pub fn at_column(&self, column: &Column, what: impl Into<String>) -> Message {
        self.sheet.at_column(column, what)
    }

    /// A message about a row that was read before, known by its line number alone.
    pub fn at_line(&self, line: usize, what: impl Into<String>) -> Message {
        self.sheet.at_line(line, what)
    }

    /// A message for a table that ends after its first line.
    pub fn no_rows(&self) -> Message {
        Message::bad_input("the file names columns but has no row of data")
            .at(Place {
                file: self.sheet.path.clone(),
                line: self.sheet.header_number,
                column: 1,
                text: self.sheet.header.clone(),
                length: self.sheet.header.len(),
            })
            .remedy("add the data below the first line")
    }

    /// The next row; comments, blank lines and rows of nothing but separators are passed over. `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read on, or the line is not a row of this table.
    pub fn next_row(&mut self) -> Result<Option<Row<'_>>, Message> {
        let Self {
            sheet,
            decimal,
            rows,
        } = self;
        match rows {
            Rows::Text(text) => {
                let row = text.next(sheet, decimal)?;
                row.map(|row| complete(sheet, row)).transpose()
            }
            #[cfg(feature = "parquet")]
            Rows::Parquet(columns) => {
                if columns.next >= columns.batch.rows && !columns.fill(sheet)? {
                    return Ok(None);
                }
                columns.next += 1;
                Ok(Some(columns.batch.row(sheet, decimal, columns.next - 1)))
            }
        }
    }

    fn next_line(&mut self) -> Result<Option<Row<'_>>, Message> {
        match &mut self.rows {
            Rows::Text(text) => text.next(&self.sheet, &self.decimal),
            #[cfg(feature = "parquet")]
            Rows::Parquet(_) => Ok(None),
        }
    }
}

/// Which of the known columns one of these names is: as it is written, or but for capitals.
fn meant<'k>(names: &[&str], known: &[&'k str]) -> Option<&'k str> {
    let find = |same: &dyn Fn(&str, &str) -> bool| {
        let mut found = known.iter().filter(|k| names.iter().any(|n| same(n, k)));
        found.next().copied()
    };
    find(&|name, known| name == known)
        .or_else(|| find(&|name, known| name.eq_ignore_ascii_case(known)))
}

impl Text {
    /// The next line that is neither blank nor a comment.
    fn next<'a>(
        &'a mut self,
        sheet: &'a Sheet,
        decimal: &'a Cell<Decimal>,
    ) -> Result<Option<Row<'a>>, Message> {
        let end = sheet.dialect.line_end.last_byte();
        while !self.walk.seek(end, &self.chunk) {
            let filled = self.blocks.fill(&mut self.chunk);
            self.blocks.note_end();
            if !filled.map_err(|e| cannot_read(&sheet.path, &e))? {
                return Ok(None);
            }
            self.chunk.find_seams(sheet.dialect);
            self.walk.begin(&self.chunk);
        }
        self.walk.next(sheet, &self.chunk, decimal)
    }
}
