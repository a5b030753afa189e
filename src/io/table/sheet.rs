//! What is known of a table beside its rows: how it is written, its columns, and messages about them.

use std::path::PathBuf;

use super::column::{Column, Heading};
use super::trouble::place_of_field;
use crate::io::columns::ColumnMap;
use crate::io::dialect::Dialect;
use crate::io::message::{Message, Place};

/// A table without its rows.
pub(super) struct Sheet {
    pub path: PathBuf,
    pub dialect: Dialect,
    pub names: Vec<String>,
    pub headings: Vec<Heading>,
    pub map: ColumnMap,
    /// Whether columns can be given roles.
    pub renamable: bool,
    pub header: String,
    pub header_number: usize,
}

impl Sheet {
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

    /// A message about a line of which only the number is at hand.
    pub fn at_line(&self, line: usize, what: impl Into<String>) -> Message {
        Message::bad_input(what).at(Place {
            file: self.path.clone(),
            line,
            column: 1,
            text: String::new(),
            length: 0,
        })
    }
}
