//! All rows of a table at once: chunks are worked at in parallel while the next ones are read and hashed.

use std::cell::Cell;
use std::io;

use rayon::prelude::*;

use super::blocks::Blocks;
use super::chunk::{Chunk, Walk, complete};
#[cfg(feature = "parquet")]
use super::parquet::Columns;
use super::sheet::Sheet;
use super::trouble::cannot_read;
use super::{Row, Rows, TableReader, Text};
use crate::io::dialect::Decimal;
use crate::io::message::Message;

/// Chunks in work at once, and as many that are being read meanwhile.
const TOGETHER: usize = 8;

/// What came of a chunk: what was gathered, and the decimal mark that its rows use.
type Outcome<T> = Result<(T, Decimal), Message>;

impl TableReader {
    /// Gathers from all rows that are left: `each` adds a row to what is gathered of a stretch of rows, `join`
    /// takes the stretches in the order of the file, with the number of stretches that the whole file is like
    /// as far as that is known. The first row of the file that is refused ends it, as with
    /// [`next_row`](Self::next_row).
    ///
    /// # Errors
    /// The file cannot be read on, a line is not a row of this table, or `each` refuses a row.
    pub fn gather<T: Default + Send>(
        &mut self,
        each: impl Fn(Row<'_>, &mut T) -> Result<(), Message> + Sync,
        mut join: impl FnMut(T, Option<f64>),
    ) -> Result<(), Message> {
        let Self {
            sheet,
            decimal,
            rows: source,
        } = self;
        let Text {
            blocks,
            chunk,
            walk,
        } = match source {
            Rows::Text(text) => &mut **text,
            #[cfg(feature = "parquet")]
            Rows::Parquet(columns) => return of_columns(sheet, columns, &each, join),
        };
        // What is left of the chunk at hand: of a small file, all.
        let first = rows(sheet, chunk, walk, decimal, &each)?;
        join(first, blocks.whole_to_given());
        let mut now = Batch::default();
        let mut next = Batch::default();
        now.fill(blocks);
        while !now.chunks.is_empty() {
            let mark = decimal.get();
            let ((), outcomes) = rayon::join(
                || next.fill(blocks),
                || {
                    let chunks = now.chunks.par_iter_mut();
                    let outcomes = chunks.map(|chunk| of_chunk(sheet, chunk, mark, &each));
                    outcomes.collect::<Vec<Outcome<T>>>()
                },
            );
            blocks.note_end();
            for (chunk, outcome) in now.chunks.iter().zip(outcomes) {
                let (part, used) = outcome?;
                let known = decimal.get();
                let part = if used == known || used == mark {
                    part
                } else if known == Decimal::Undecided {
                    decimal.set(used);
                    part
                } else {
                    // Another mark than in the rows before: the row that has it is told of.
                    of_chunk_again(sheet, chunk, known, &each)?.0
                };
                join(part, blocks.whole_to_given());
            }
            if let Some(error) = now.broken.take() {
                return Err(cannot_read(&sheet.path, &error));
            }
            now.spare.append(&mut now.chunks);
            std::mem::swap(&mut now, &mut next);
        }
        chunk.length = 0;
        match now.broken {
            Some(error) => Err(cannot_read(&sheet.path, &error)),
            None => Ok(()),
        }
    }
}

/// Rows of a Parquet file that are worked at by one thread.
#[cfg(feature = "parquet")]
const ROWS: usize = 1 << 13;

#[cfg(feature = "parquet")]
fn of_columns<T: Default + Send>(
    sheet: &Sheet,
    columns: &mut Columns,
    each: &(impl Fn(Row<'_>, &mut T) -> Result<(), Message> + Sync),
    mut join: impl FnMut(T, Option<f64>),
) -> Result<(), Message> {
    let whole = columns.row_count() as f64;
    while columns.next < columns.batch.rows || columns.fill(sheet)? {
        let (now, rows) = (&columns.batch, columns.batch.rows);
        let starts = (columns.next..rows).into_par_iter().step_by(ROWS);
        let parts = starts.map(|start| {
            let decimal = Cell::new(Decimal::Point);
            let mut part = T::default();
            for at in start..rows.min(start + ROWS) {
                each(now.row(sheet, &decimal, at), &mut part)?;
            }
            Ok(part)
        });
        let parts = parts.collect::<Vec<Result<T, Message>>>();
        columns.next = rows;
        let read = columns.batch.before + rows;
        for part in parts {
            join(part?, Some(whole / read as f64));
        }
    }
    Ok(())
}

/// Chunks that were read and not yet worked at.
#[derive(Default)]
struct Batch {
    chunks: Vec<Chunk>,
    spare: Vec<Chunk>,
    /// Why no more could be read.
    broken: Option<io::Error>,
}

impl Batch {
    fn fill(&mut self, blocks: &mut Blocks) {
        while self.chunks.len() < TOGETHER && self.broken.is_none() {
            let mut chunk = self.spare.pop().unwrap_or_default();
            match blocks.fill(&mut chunk) {
                Ok(true) => self.chunks.push(chunk),
                Ok(false) => {
                    self.spare.push(chunk);
                    return;
                }
                Err(error) => self.broken = Some(error),
            }
        }
    }
}

fn of_chunk<T: Default>(
    sheet: &Sheet,
    chunk: &mut Chunk,
    mark: Decimal,
    each: &impl Fn(Row<'_>, &mut T) -> Result<(), Message>,
) -> Outcome<T> {
    chunk.find_seams(sheet.dialect);
    of_chunk_again(sheet, chunk, mark, each)
}

fn of_chunk_again<T: Default>(
    sheet: &Sheet,
    chunk: &Chunk,
    mark: Decimal,
    each: &impl Fn(Row<'_>, &mut T) -> Result<(), Message>,
) -> Outcome<T> {
    let decimal = Cell::new(mark);
    let mut walk = Walk::default();
    walk.begin(chunk);
    let part = rows(sheet, chunk, &mut walk, &decimal, each)?;
    Ok((part, decimal.get()))
}

fn rows<T: Default>(
    sheet: &Sheet,
    chunk: &Chunk,
    walk: &mut Walk,
    decimal: &Cell<Decimal>,
    each: &impl Fn(Row<'_>, &mut T) -> Result<(), Message>,
) -> Result<T, Message> {
    let mut part = T::default();
    let end = sheet.dialect.line_end.last_byte();
    while walk.seek(end, chunk) {
        if let Some(row) = walk.next(sheet, chunk, decimal)? {
            each(complete(sheet, row)?, &mut part)?;
        }
    }
    Ok(part)
}
