//! Tables in Parquet files: columns are decoded some rows at a time, beside each other, and rows are told by
//! their number.

use std::cell::Cell;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::OnceLock;

use parquet::basic::{ConvertedType, LogicalType};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use rayon::prelude::*;

use super::row::{Cells, Row};
use super::sheet::Sheet;
use super::trouble::cannot_read;
use crate::io::dialect::Decimal;
use crate::io::message::Message;
use crate::io::source::Source;

/// Rows that are decoded at once.
const ROWS: usize = 1 << 16;

/// The columns of a file, being read.
pub(super) struct Columns {
    columns: Vec<Reading>,
    /// Rows of each group of rows.
    groups: Vec<usize>,
    /// The group at hand, and its rows that are left.
    group: usize,
    left: usize,
    /// The rows at hand.
    pub batch: Batch,
    /// The row of the batch that is next.
    pub next: usize,
}

/// A column, read through a handle of its own: columns are read beside each other.
struct Reading {
    file: SerializedFileReader<File>,
    reader: Option<ColumnReader>,
}

/// Some rows.
#[derive(Default)]
pub(super) struct Batch {
    /// Rows of the file before these.
    pub before: usize,
    pub rows: usize,
    columns: Vec<Values>,
    /// Numbers as they are written, where somebody asked for them.
    written: Vec<OnceLock<Vec<String>>>,
}

/// The values of a column.
enum Values {
    /// The column has no role.
    NotRead,
    /// Not a number where the field is empty.
    Numbers(Vec<f64>),
    /// Empty where the field is empty.
    Texts(Vec<ByteArray>),
}

impl Columns {
    /// Opens a file; its columns' names beside it. Its digest is taken where one is wanted.
    ///
    /// # Errors
    /// It cannot be read, or is no Parquet file of plain columns.
    pub fn open(path: &Path) -> Result<(Self, Vec<String>), Message> {
        let unreadable = |e: std::io::Error| cannot_read(path, &e);
        let open = || File::open(path).map_err(unreadable);
        if !open()?.metadata().map_err(unreadable)?.is_file() {
            return Err(Message::bad_input("Parquet is read from files alone")
                .in_file(path)
                .remedy("write it to a file, and name that"));
        }
        let mut source = Source::open(path).map_err(unreadable)?;
        if source.is_hashed() {
            let mut block = vec![0; 1 << 18];
            while source.read(&mut block).map_err(unreadable)? > 0 {}
        }
        let opened = || SerializedFileReader::new(open()?).map_err(|e| broken(path, &e));
        let file = opened()?;
        let schema = file.metadata().file_metadata().schema_descr();
        let fields = schema.root_schema().get_fields();
        if let Some(nested) = fields.iter().find(|f| !f.is_primitive()) {
            return Err(
                Message::bad_input(format!("column `{}` is nested", nested.name()))
                    .in_file(path)
                    .remedy("write a Parquet file of plain columns"),
            );
        }
        let names: Vec<String> = fields.iter().map(|f| f.name().to_owned()).collect();
        let groups = file.metadata().row_groups().iter();
        let groups = groups.map(|g| usize::try_from(g.num_rows()).unwrap_or(0));
        let groups: Vec<usize> = groups.collect();
        let columns = names.iter().map(|_| {
            Ok(Reading {
                file: opened()?,
                reader: None,
            })
        });
        let columns = columns.collect::<Result<_, Message>>()?;
        Ok((
            Self {
                columns,
                groups,
                group: 0,
                left: 0,
                batch: Batch::default(),
                next: 0,
            },
            names,
        ))
    }

    /// Rows of the whole file.
    pub fn row_count(&self) -> usize {
        self.groups.iter().sum()
    }

    /// Decodes the next rows; false where none are left.
    ///
    /// # Errors
    /// The file is broken, or a column holds what is neither number nor text.
    pub fn fill(&mut self, sheet: &Sheet) -> Result<bool, Message> {
        while self.left == 0 {
            let Some(rows) = self.groups.get(self.group) else {
                self.batch.rows = 0;
                self.next = 0;
                return Ok(false);
            };
            self.left = *rows;
            self.group += 1;
            for column in &mut self.columns {
                column.reader = None;
            }
        }
        let (rows, group) = (self.left.min(ROWS), self.group - 1);
        let before = self.batch.before + self.batch.rows;
        let columns = self.columns.par_iter_mut().enumerate();
        let columns = columns.map(|(i, column)| {
            let is_read = sheet.headings.get(i).is_some_and(|h| !h.name.is_empty());
            match is_read {
                true => column.decode(sheet, group, i, rows),
                false => Ok(Values::NotRead),
            }
        });
        let columns = columns.collect::<Result<Vec<_>, Message>>()?;
        self.left -= rows;
        self.next = 0;
        self.batch = Batch {
            before,
            rows,
            written: columns.iter().map(|_| OnceLock::new()).collect(),
            columns,
        };
        Ok(true)
    }
}

impl Reading {
    fn decode(
        &mut self,
        sheet: &Sheet,
        group: usize,
        index: usize,
        rows: usize,
    ) -> Result<Values, Message> {
        let broken = |e: ParquetError| broken(&sheet.path, &e);
        let reader = match &mut self.reader {
            Some(reader) => reader,
            empty => {
                let group = self.file.get_row_group(group).map_err(broken)?;
                empty.insert(group.get_column_reader(index).map_err(broken)?)
            }
        };
        let schema = self.file.metadata().file_metadata().schema_descr();
        let column = schema.column(index);
        let refused = |what: &str| {
            let what = format!("column `{}` holds {what}", sheet.names[index]);
            let remedy = "write numbers and texts, or leave the column out";
            sheet.in_header(index, what).remedy(remedy)
        };
        let plain = !matches!(
            column.logical_type_ref(),
            Some(
                LogicalType::Timestamp { .. }
                    | LogicalType::Date
                    | LogicalType::Time { .. }
                    | LogicalType::Decimal { .. }
            )
        ) && column.converted_type() != ConvertedType::DECIMAL;
        if !plain {
            return Err(refused("dates, times or decimals"));
        }
        let none = f64::NAN;
        let read = match reader {
            ColumnReader::DoubleColumnReader(r) => read(r, rows, |v| v, none).map(Values::Numbers),
            // The number that its digits say, as in any other table.
            ColumnReader::FloatColumnReader(r) => {
                read(r, rows, |v| v.to_string().parse().unwrap_or(none), none).map(Values::Numbers)
            }
            ColumnReader::Int32ColumnReader(r) => {
                read(r, rows, f64::from, none).map(Values::Numbers)
            }
            ColumnReader::Int64ColumnReader(r) => {
                read(r, rows, |v| v as f64, none).map(Values::Numbers)
            }
            ColumnReader::BoolColumnReader(r) => {
                let text = |v| if v { "true" } else { "false" }.into();
                read(r, rows, text, "".into()).map(Values::Texts)
            }
            ColumnReader::ByteArrayColumnReader(r) => {
                read(r, rows, |v| v, "".into()).map(Values::Texts)
            }
            ColumnReader::Int96ColumnReader(_) => return Err(refused("dates, times or decimals")),
            ColumnReader::FixedLenByteArrayColumnReader(_) => {
                return Err(refused("bytes that are no text"));
            }
        };
        match read.map_err(broken)? {
            Values::Texts(texts) if texts.iter().any(|t| t.as_utf8().is_err()) => {
                Err(refused("bytes that are no text"))
            }
            values => Ok(values),
        }
    }
}

/// The values of some rows, `empty` where there are none.
fn read<T: DataType, V: Clone>(
    reader: &mut ColumnReaderImpl<T>,
    rows: usize,
    value: impl Fn(T::T) -> V,
    empty: V,
) -> Result<Vec<V>, ParquetError> {
    let (mut levels, mut values) = (Vec::new(), Vec::with_capacity(rows));
    let mut found = 0;
    while found < rows {
        let left = rows - found;
        let (records, ..) = reader.read_records(left, Some(&mut levels), None, &mut values)?;
        if records == 0 {
            let what = "a column has fewer rows than its group".to_owned();
            return Err(ParquetError::General(what));
        }
        found += records;
    }
    let complete = values.len() == rows;
    let mut values = values.into_iter().map(value);
    if complete {
        return Ok(values.collect());
    }
    let filled = levels.iter().map(|level| match level {
        0 => empty.clone(),
        _ => values.next().unwrap_or_else(|| empty.clone()),
    });
    Ok(filled.collect())
}

impl Batch {
    /// One of its rows.
    pub fn row<'a>(&'a self, sheet: &'a Sheet, decimal: &'a Cell<Decimal>, at: usize) -> Row<'a> {
        Row::new(
            sheet,
            decimal,
            Cells::Columns(self, at),
            self.before + at + 1,
        )
    }

    /// A number, not a number where the field is empty; nothing where the column has texts.
    pub fn number(&self, row: usize, column: usize) -> Option<f64> {
        match self.columns.get(column)? {
            Values::Numbers(numbers) => numbers.get(row).copied(),
            Values::NotRead | Values::Texts(_) => None,
        }
    }

    /// The text of a field.
    pub fn text(&self, row: usize, column: usize) -> &str {
        match self.columns.get(column) {
            Some(Values::Texts(texts)) => texts.get(row).and_then(|t| t.as_utf8().ok()),
            Some(Values::Numbers(numbers)) => {
                let written = self.written[column].get_or_init(|| {
                    let text = |v: &f64| {
                        if v.is_nan() {
                            String::new()
                        } else {
                            v.to_string()
                        }
                    };
                    numbers.iter().map(text).collect()
                });
                written.get(row).map(String::as_str)
            }
            Some(Values::NotRead) | None => None,
        }
        .unwrap_or("")
    }

    /// The row as the line of a table.
    pub fn line(&self, row: usize) -> String {
        let field = |column: usize| match self.number(row, column) {
            Some(v) if v.is_nan() => String::new(),
            Some(v) => v.to_string(),
            None => {
                let text = self.text(row, column);
                match text.contains(['"', ',', '\n', '\r']) {
                    true => format!("\"{}\"", text.replace('"', "\"\"")),
                    false => text.to_owned(),
                }
            }
        };
        let fields: Vec<String> = (0..self.columns.len()).map(field).collect();
        fields.join(",")
    }

    pub fn column_count(&self) -> usize {
        self.columns.len()
    }
}

fn broken(path: &Path, error: &ParquetError) -> Message {
    Message::bad_input(format!("the file cannot be read as Parquet: {error}"))
        .in_file(path)
        .remedy("give a Parquet file of plain columns, with Snappy compression or none")
}
