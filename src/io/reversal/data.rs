//! Reading the readings of a reversal: tidy (one row a reading) or wide (one column a channel).

use std::path::Path;

use errsep_models::reversal::{Channel, Direction, Observations, Reading};

use crate::io::dialect::Dialect;
use crate::io::message::{Place, list};
use crate::io::units::LengthUnit;
use crate::io::{Column, ColumnMap, Message, Row, TableReader};

/// What a column can hold.
pub(super) const ROLES: [&str; 10] = [
    "channel",
    "repeat",
    "direction",
    "time",
    "x",
    "reading",
    "1A",
    "1B",
    "2A",
    "2B",
];

/// How the readings are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// One row a reading, with the columns `channel` and `reading`.
    Tidy,
    /// One row a position, with a column for each channel.
    Wide,
}

/// The readings of a file and what was found out about it.
#[derive(Debug, Clone)]
pub struct ReversalData {
    /// The readings, in the order of the file.
    pub observations: Observations,
    /// How the file is written.
    pub dialect: Dialect,
    /// How the readings are laid out.
    pub layout: Layout,
    /// Columns that were not read (only where columns were renamed).
    pub ignored: Vec<String>,
    /// Empty fields of a wide table: positions at which a channel was not read.
    pub gaps: usize,
    pub(super) first: [Option<Place>; 4],
}

impl ReversalData {
    /// The channels that have no reading.
    pub fn missing(&self) -> Vec<Channel> {
        Channel::ALL
            .into_iter()
            .filter(|c| self.first[c.index()].is_none())
            .collect()
    }

    /// Where the first reading of a channel stands.
    pub fn first_reading(&self, channel: &str) -> Option<&Place> {
        self.first[Channel::from_name(channel)?.index()].as_ref()
    }

    /// How the file was read, in words.
    pub fn in_words(&self) -> String {
        let layout = match self.layout {
            Layout::Tidy => "one row a reading",
            Layout::Wide => "one column a channel",
        };
        let mut text = format!("{}; {layout}", self.dialect);
        if self.gaps > 0 {
            text += &format!("; {} empty fields taken as positions not read", self.gaps);
        }
        if !self.ignored.is_empty() {
            text += &format!("; columns not read: {}", self.ignored.join(", "));
        }
        text
    }
}

pub(super) struct Scales {
    x_mm: f64,
    /// µm in the unit of each channel's readings.
    pub(super) reading_um: [f64; 4],
}

pub(super) struct Columns {
    x: Column,
    repeat: Option<Column>,
    direction: Option<Column>,
    time: Option<Column>,
    pub(super) readings: Readings,
    pub(super) scales: Scales,
}

pub(super) enum Readings {
    Tidy { channel: Column, reading: Column },
    Wide(Vec<(Channel, Column)>),
}

/// Reads the readings of a reversal.
///
/// # Errors
/// The file is no table, a column is unknown or missing, a field is not what its column holds, a
/// reading is there twice, a channel's column is empty.
pub fn read(path: &Path, map: &ColumnMap) -> Result<ReversalData, Message> {
    read_table(TableReader::open_as(path, map)?)
}

/// The same from a table that is open.
pub(super) fn read_table(mut table: TableReader) -> Result<ReversalData, Message> {
    let columns = find_columns(&table)?;
    let mut data = ReversalData {
        observations: Observations::default(),
        dialect: table.dialect(),
        layout: match columns.readings {
            Readings::Tidy { .. } => Layout::Tidy,
            Readings::Wide(_) => Layout::Wide,
        },
        ignored: table.ignored(),
        gaps: 0,
        first: [const { None }; 4],
    };
    let mut lines: Vec<u32> = Vec::new();
    let mut rows = 0_usize;
    let readings = &mut data.observations.readings;
    table.gather(
        |row, part: &mut Part| part.add(row, &columns),
        |part, whole_to_given| {
            rows += part.rows;
            data.gaps += part.gaps;
            for (first, found) in data.first.iter_mut().zip(part.first) {
                *first = first.take().or(found);
            }
            if readings.capacity() < readings.len() + part.readings.len() {
                // Room for the whole file at once: what grows step by step is copied and held twice.
                let read = readings.len() + part.readings.len();
                let whole = whole_to_given.unwrap_or(2.0).max(1.0) * 1.02;
                let more = ((whole * read as f64) as usize).max(read + read / 8) - readings.len();
                readings.reserve_exact(more);
                lines.reserve_exact(more);
            }
            readings.extend(part.readings);
            lines.extend(part.lines);
        },
    )?;
    if rows == 0 {
        return Err(table.no_rows());
    }
    if let Readings::Wide(channels) = &columns.readings
        && let Some((channel, column)) = channels
            .iter()
            .find(|(c, _)| data.first[c.index()].is_none())
    {
        return Err(table
            .at_column(
                column,
                format!("channel {} has a column but no reading", channel.name()),
            )
            .remedy("fill the column, or remove it: the rest is then solved as far as it goes"));
    }
    refuse_duplicates(&table, &data.observations.readings, &lines)?;
    data.dialect = table.dialect();
    Ok(data)
}

pub(super) fn find_columns(table: &TableReader) -> Result<Columns, Message> {
    table.only(&ROLES)?;
    let tidy = ["channel", "reading"]
        .iter()
        .any(|role| table.optional(role).is_some());
    let mut wide = Vec::new();
    for channel in Channel::ALL {
        if let Some(column) = table.optional(channel.name()) {
            wide.push((channel, column));
        }
    }
    let readings = match (tidy, wide.first()) {
        (true, Some((channel, column))) => {
            return Err(table
                .at_column(
                    column,
                    format!(
                        "column {} beside `channel` or `reading`: one row a reading, or one column a channel?",
                        channel.name()
                    ),
                )
                .remedy("keep channel,x,reading or x,1A,1B,2A,2B, not both"));
        }
        (false, Some(_)) => Readings::Wide(wide),
        (_, None) => Readings::Tidy {
            channel: table.column("channel")?,
            reading: table.column("reading")?,
        },
    };
    let x = table.column("x")?;
    let in_um = |column: &Column| column.length_unit().unwrap_or(LengthUnit::Um).in_um();
    let mut reading_um = [1.0; 4];
    match &readings {
        Readings::Tidy { reading, .. } => reading_um = [in_um(reading); 4],
        Readings::Wide(wide) => {
            for (channel, column) in wide {
                reading_um[channel.index()] = in_um(column);
            }
        }
    }
    Ok(Columns {
        repeat: table.optional("repeat"),
        direction: table.optional("direction"),
        time: table.optional("time").map(Column::in_s),
        scales: Scales {
            x_mm: x.length_unit().unwrap_or(LengthUnit::Mm).in_mm(),
            reading_um,
        },
        x: x.as_written(),
        readings: match readings {
            Readings::Tidy { channel, reading } => Readings::Tidy {
                channel,
                reading: reading.as_written(),
            },
            Readings::Wide(wide) => Readings::Wide(
                wide.into_iter()
                    .map(|(channel, column)| (channel, column.as_written()))
                    .collect(),
            ),
        },
    })
}

/// Rows for which there is room at first.
const ROWS: usize = 2048;

/// What is read from some rows that follow each other.
#[derive(Default)]
struct Part {
    readings: Vec<Reading>,
    /// The line of each reading.
    lines: Vec<u32>,
    rows: usize,
    gaps: usize,
    first: [Option<Place>; 4],
}

impl Part {
    fn add(&mut self, row: Row<'_>, columns: &Columns) -> Result<(), Message> {
        if self.rows == 0 {
            self.readings.reserve(ROWS);
            self.lines.reserve(ROWS);
        }
        self.rows += 1;
        read_row(row, columns, self)?;
        let line = u32::try_from(row.line()).unwrap_or(u32::MAX);
        self.lines.resize(self.readings.len(), line);
        Ok(())
    }
}

/// Greatest reading: the square of a sum of squares of them must be finite.
const GREATEST: f64 = 1e60;

/// A reading of a row in µm.
///
/// # Errors
/// It is no number, or one whose square is none.
pub(super) fn reading_of(row: Row<'_>, column: &Column, in_um: f64) -> Result<f64, Message> {
    let value = row.number(column)? * in_um;
    if value.abs() <= GREATEST {
        return Ok(value);
    }
    Err(row
        .error(
            column,
            format!(
                "a reading of {} cannot be worked with: its square overflows",
                row.text(column)
            ),
        )
        .remedy("correct it, or remove the row"))
}

fn read_row(row: Row<'_>, columns: &Columns, data: &mut Part) -> Result<(), Message> {
    let x = row.number(&columns.x)? * columns.scales.x_mm;
    let repeat = match &columns.repeat {
        Some(column) => row.count(column)?,
        None => 1,
    };
    let direction = match &columns.direction {
        Some(column) => direction(row, column)?,
        None => Direction::Forward,
    };
    let time = match &columns.time {
        Some(column) => Some(row.number(column)?),
        None => None,
    };
    let mut add = |channel: Channel, column: &Column| -> Result<(), Message> {
        let value = reading_of(row, column, columns.scales.reading_um[channel.index()])?;
        data.first[channel.index()].get_or_insert_with(|| row.place(column));
        data.readings.push(Reading {
            channel,
            repeat,
            direction,
            time,
            x,
            value,
        });
        Ok(())
    };
    match &columns.readings {
        Readings::Tidy { channel, reading } => add(channel_of(row, channel)?, reading),
        Readings::Wide(channels) => {
            for (channel, column) in channels {
                if row.is_empty(column) {
                    data.gaps += 1;
                } else {
                    add(*channel, column)?;
                }
            }
            Ok(())
        }
    }
}

pub(super) fn channel_of(row: Row<'_>, column: &Column) -> Result<Channel, Message> {
    let names = Channel::ALL.map(Channel::name);
    if let Some(index) = row.one_of(column, &names) {
        return Ok(Channel::ALL[index]);
    }
    let text = row.text(column);
    let found = Channel::from_name(text);
    let found = found.or_else(|| Channel::from_name(&text.to_ascii_uppercase()));
    found.ok_or_else(|| {
        if text.is_empty() {
            return row
                .error(column, "channel is missing: the field is empty")
                .remedy(format!("write {}", list(&names)));
        }
        row.error(column, format!("unknown channel `{text}`"))
            .remedy(format!(
                "write {}: position 1 is 0°, 2 is 180°; A is the side that the near indicator sees at 0°",
                list(&names)
            ))
    })
}

pub(super) fn direction(row: Row<'_>, column: &Column) -> Result<Direction, Message> {
    match row.one_of(column, &["forward", "backward"]) {
        Some(0) => Ok(Direction::Forward),
        Some(_) => Ok(Direction::Backward),
        None => {
            let other = row.text(column);
            Err(row
                .error(column, format!("unknown direction `{other}`"))
                .remedy("write forward (towards greater x) or backward"))
        }
    }
}

/// Two readings of the same channel, repeat, direction, time and position are one too many.
fn refuse_duplicates(
    table: &TableReader,
    readings: &[Reading],
    lines: &[u32],
) -> Result<(), Message> {
    let compare = |a: &Reading, b: &Reading| {
        a.channel
            .cmp(&b.channel)
            .then(a.repeat.cmp(&b.repeat))
            .then(a.direction.cmp(&b.direction))
            .then(a.x.total_cmp(&b.x))
            .then(a.time.unwrap_or(0.0).total_cmp(&b.time.unwrap_or(0.0)))
    };
    // In files written in the order of measurement each channel ascends: nothing is there twice.
    let mut before: [Option<&Reading>; 4] = [None; 4];
    let ascends = readings.iter().all(|r| {
        let before = before[r.channel.index()].replace(r);
        before.is_none_or(|before| compare(before, r).is_lt())
    });
    if ascends {
        return Ok(());
    }
    let mut order = (0..u32::try_from(readings.len()).unwrap_or(u32::MAX)).collect::<Vec<_>>();
    order.sort_by(|&a, &b| compare(&readings[a as usize], &readings[b as usize]));
    let twice = order
        .windows(2)
        .filter(|w| compare(&readings[w[0] as usize], &readings[w[1] as usize]).is_eq())
        .map(|w| (w[0].max(w[1]) as usize, w[0].min(w[1]) as usize))
        .min();
    let Some((later, earlier)) = twice else {
        return Ok(());
    };
    let r = &readings[later];
    Err(table
        .at_line(
            lines[later] as usize,
            format!(
                "channel {} at x = {} mm was read in line {} already",
                r.channel.name(),
                r.x,
                lines[earlier]
            ),
        )
        .remedy("remove one of the two, or number repeats in a column `repeat`"))
}
