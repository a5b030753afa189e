//! Reading the readings of other designs: channels by the angles of indicator and spindle.

use std::collections::HashMap;
use std::path::Path;

use errsep_models::reversal::designs::{
    Design, DesignChannel, DesignObservations, DesignReading, MOST_CHANNELS,
};
use errsep_models::reversal::{Channel, Direction, Observations, Reading};

use super::data::{Layout, ReversalData, direction, read_table, reading_of};
use super::setup::ReversalSetup;
use crate::io::dialect::Dialect;
use crate::io::message::{Place, list, nearest};
use crate::io::units::LengthUnit;
use crate::io::{Column, Message, Row, TableReader};

/// The readings of a design and what was found out about the file.
#[derive(Debug, Clone)]
pub struct DesignData {
    /// The readings, in the order of the file.
    pub observations: DesignObservations,
    /// How the file is written.
    pub dialect: Dialect,
    /// Where the first reading of each channel stands.
    pub first: Vec<Place>,
    /// Channels of the set-up that have no reading.
    pub not_read: Vec<String>,
    /// How the readings are laid out.
    pub layout: Layout,
    /// Empty fields of a wide table: positions at which a channel was not read.
    pub gaps: usize,
}

impl DesignData {
    /// How the file was read, in words.
    pub fn in_words(&self) -> String {
        match (self.layout, self.gaps) {
            (Layout::Tidy, _) => self.dialect.to_string(),
            (Layout::Wide, 0) => format!("{}; one column a channel", self.dialect),
            (Layout::Wide, gaps) => format!(
                "{}; one column a channel; {gaps} empty fields taken as positions not read",
                self.dialect
            ),
        }
    }
}

/// Readings of the four channels, or of another design.
#[derive(Debug)]
pub enum Readings {
    /// Of 1A, 1B, 2A, 2B.
    Four(ReversalData),
    /// Of other angles.
    Other(DesignData),
}

const ROLES: [&str; 8] = [
    "channel",
    "indicator",
    "spindle",
    "repeat",
    "direction",
    "time",
    "x",
    "reading",
];

/// Reads the readings of a reversal. Columns `indicator` and `spindle`, or `[channels]` in the set-up,
/// make it one of any design; where its angles are those of the four channels, it is theirs.
///
/// # Errors
/// As [`read`](super::read); and angles that are missing, two channels of one pair of angles, or a
/// channel without angles.
pub fn read_any(path: &Path, setup: &ReversalSetup) -> Result<Readings, Message> {
    let table = TableReader::open_as(path, &setup.columns)?;
    let has = |name: &str| table.optional(name).is_some();
    if setup.channels.is_empty() && !has("indicator") && !has("spindle") {
        return read_table(table).map(Readings::Four);
    }
    let data = read_design(table, setup)?;
    let channels = data.observations.design.channels();
    let four: Option<Vec<Channel>> = channels.iter().map(DesignChannel::of_four).collect();
    Ok(match four {
        Some(four) if setup.zero == Default::default() => Readings::Four(as_four(&data, &four)),
        _ => Readings::Other(data),
    })
}

/// How a row tells its channel.
enum Naming {
    Angles(Column, Column),
    Name(Column),
}

/// Where a row has its readings, each with the µm in its unit.
enum Fields {
    One(Naming, Column, f64),
    /// A column for each channel, with its name.
    Wide(Vec<(String, Column, f64)>),
}

/// The names that a column of a channel can have: those of the set-up, and 1A, 1B, 2A, 2B.
fn channel_names(setup: &ReversalSetup) -> Vec<String> {
    let own = setup.channels.iter().map(|c| c.name.clone());
    let four = Channel::ALL.map(|c| c.name().to_owned());
    let mut names: Vec<String> = own.chain(four).collect();
    names.retain(|name| !ROLES.contains(&&name[..]));
    names.dedup();
    names
}

/// The columns of a wide table: one a channel.
pub(super) fn wide_columns(
    table: &TableReader,
    setup: &ReversalSetup,
) -> Vec<(String, Column, f64)> {
    let of = |name: String| {
        let column = table.optional(&name)?;
        let in_um = column.length_unit().unwrap_or(LengthUnit::Um).in_um();
        Some((name, column.as_written(), in_um))
    };
    let mut wide: Vec<_> = channel_names(setup).into_iter().filter_map(of).collect();
    wide.sort_by_key(|(_, column, _)| column.index());
    wide.dedup_by_key(|(_, column, _)| column.index());
    wide
}

/// Where the readings of a table stand.
///
/// # Errors
/// Columns that are missing, or that belong to different layouts.
fn fields(table: &TableReader, setup: &ReversalSetup) -> Result<Fields, Message> {
    let wide = wide_columns(table, setup);
    let tidy = ["channel", "indicator", "spindle", "reading"];
    match (
        wide.first(),
        tidy.iter().find(|role| table.optional(role).is_some()),
    ) {
        (Some((name, column, _)), Some(role)) => {
            let what = format!(
                "column {name} beside `{role}`: one row a reading, or one column a channel?"
            );
            return Err(table
                .at_column(column, what)
                .remedy("keep one column a channel, or channel,x,reading, not both"));
        }
        (Some(_), None) => return Ok(Fields::Wide(wide)),
        (None, _) => {}
    }
    let naming = match (
        table.optional("indicator"),
        table.optional("spindle"),
        table.optional("channel"),
    ) {
        (None, None, _) => Naming::Name(table.column("channel")?),
        (Some(angle), _, Some(_)) | (None, Some(angle), Some(_)) => {
            return Err(table
                .at_column(&angle, "a column `channel` stands beside the angles")
                .remedy(
                    "keep `indicator` and `spindle`, or `channel` with [channels] in the set-up",
                ));
        }
        _ => Naming::Angles(table.column("indicator")?, table.column("spindle")?),
    };
    let reading = table.column("reading")?;
    let in_um = reading.length_unit().unwrap_or(LengthUnit::Um).in_um();
    Ok(Fields::One(naming, reading.as_written(), in_um))
}

fn read_design(mut table: TableReader, setup: &ReversalSetup) -> Result<DesignData, Message> {
    let names = channel_names(setup);
    let names = names.iter().map(|name| &name[..]);
    table.only(&ROLES.into_iter().chain(names).collect::<Vec<_>>())?;
    let fields = fields(&table, setup)?;
    let x = table.column("x")?;
    let (repeat, way) = (table.optional("repeat"), table.optional("direction"));
    let time = table.optional("time").map(Column::in_s);
    let x_mm = x.length_unit().unwrap_or(LengthUnit::Mm).in_mm();
    let x = x.as_written();
    let mut found = Found {
        known: setup.channels.clone(),
        ..Found::default()
    };
    let (mut readings, mut lines, mut gaps, mut rows) = (Vec::new(), Vec::new(), 0, 0_usize);
    while let Some(row) = table.next_row()? {
        rows += 1;
        let common = DesignReading {
            channel: 0,
            repeat: repeat.as_ref().map_or(Ok(1), |c| row.count(c))?,
            direction: way
                .as_ref()
                .map_or(Ok(Direction::Forward), |c| direction(row, c))?,
            time: time.as_ref().map(|c| row.number(c)).transpose()?,
            x: row.number(&x)? * x_mm,
            value: 0.0,
        };
        let mut add = |channel: usize, value: f64| {
            readings.push(DesignReading {
                channel,
                value,
                ..common
            });
            lines.push(row.line());
        };
        match &fields {
            Fields::One(naming, column, in_um) => {
                add(
                    found.channel(row, naming)?,
                    reading_of(row, column, *in_um)?,
                );
            }
            Fields::Wide(columns) => {
                for (name, column, in_um) in columns {
                    if row.is_empty(column) {
                        gaps += 1;
                    } else {
                        add(
                            found.by_column(row, name, column)?,
                            reading_of(row, column, *in_um)?,
                        );
                    }
                }
            }
        }
    }
    if rows == 0 {
        return Err(table.no_rows());
    }
    if let Fields::Wide(columns) = &fields
        && let Some((name, column, _)) = columns.iter().find(|c| !found.by_name.contains_key(&c.0))
    {
        return Err(table
            .at_column(
                column,
                format!("channel {name} has a column but no reading"),
            )
            .remedy("fill the column, or remove it: the rest is then solved as far as it goes"));
    }
    refuse_duplicates(&table, &found, &readings, &lines)?;
    let names: Vec<&String> = found.channels.iter().map(|c| &c.name).collect();
    let not_read = setup.channels.iter().map(|c| c.name.clone());
    let not_read = not_read.filter(|n| !names.contains(&n)).collect();
    let design = Design::new(found.channels).map_err(|why| {
        let remedy = "give each channel its own name and angles";
        Message::bad_input(why.to_string())
            .in_file(table.path())
            .remedy(remedy)
    })?;
    Ok(DesignData {
        observations: DesignObservations { design, readings },
        dialect: table.dialect(),
        first: found.first,
        not_read,
        layout: match fields {
            Fields::One(..) => Layout::Tidy,
            Fields::Wide(_) => Layout::Wide,
        },
        gaps,
    })
}

/// The channels as they turn up.
#[derive(Default)]
struct Found {
    /// Channels of the set-up.
    known: Vec<DesignChannel>,
    channels: Vec<DesignChannel>,
    first: Vec<Place>,
    by_name: HashMap<String, usize>,
    by_angles: HashMap<(u64, u64), usize>,
}

impl Found {
    fn channel(&mut self, row: Row<'_>, naming: &Naming) -> Result<usize, Message> {
        match naming {
            Naming::Name(column) => {
                let name = row.text(column);
                if let Some(at) = self.by_name.get(name) {
                    return Ok(*at);
                }
                let channel = self.named(row, column, name)?;
                let at = self.add(row, column, channel)?;
                self.by_name.insert(name.to_owned(), at);
                Ok(at)
            }
            Naming::Angles(indicator, spindle) => {
                let angles = (row.number(indicator)?, row.number(spindle)?);
                let key = (angles.0.to_bits(), angles.1.to_bits());
                if let Some(at) = self.by_angles.get(&key) {
                    return Ok(*at);
                }
                let channel = DesignChannel::at(angles.0, angles.1).map_err(|why| {
                    row.error(indicator, why.to_string())
                        .remedy("give angles in degrees, 0 to 360")
                })?;
                // Angles within half a degree are one channel, named by the first.
                let same = self.channels.iter().position(|c| c.is_at(&channel));
                let at = match same {
                    Some(at) => at,
                    None => self.add(row, indicator, channel)?,
                };
                self.by_angles.insert(key, at);
                Ok(at)
            }
        }
    }

    /// The channel of a column of a wide table.
    fn by_column(&mut self, row: Row<'_>, name: &str, column: &Column) -> Result<usize, Message> {
        if let Some(at) = self.by_name.get(name) {
            return Ok(*at);
        }
        let channel = self.named(row, column, name)?;
        let at = self.add(row, column, channel)?;
        self.by_name.insert(name.to_owned(), at);
        Ok(at)
    }

    /// The channel of a name: of the set-up, or one of the four.
    fn named(&self, row: Row<'_>, column: &Column, name: &str) -> Result<DesignChannel, Message> {
        if let Some(channel) = self.known.iter().find(|c| c.name == name) {
            return Ok(channel.clone());
        }
        if let Some(four) = Channel::from_name(name) {
            return Ok(DesignChannel::from(four));
        }
        if name.is_empty() {
            return Err(row
                .error(column, "channel is missing: the field is empty")
                .remedy("write the name of a channel of [channels]"));
        }
        let names: Vec<&str> = self.known.iter().map(|c| &c.name[..]).collect();
        let remedy = match nearest(name, names.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? Known are {}", list(&names)),
            None => format!(
                "add `{name} = {{ indicator = …, spindle = … }}` (degrees) to [channels] of the set-up"
            ),
        };
        Err(row
            .error(column, format!("channel `{name}` has no angles"))
            .remedy(remedy))
    }

    fn add(
        &mut self,
        row: Row<'_>,
        column: &Column,
        channel: DesignChannel,
    ) -> Result<usize, Message> {
        if let Some(other) = self.channels.iter().find(|c| c.is_at(&channel)) {
            let what = format!(
                "channels {} and {} have the same angles",
                other.name, channel.name
            );
            return Err(row
                .error(column, what)
                .remedy("give one of them its own angles"));
        }
        if self.channels.len() == MOST_CHANNELS {
            return Err(row
                .error(column, format!("more than {MOST_CHANNELS} pairs of angles"))
                .remedy(
                    "each trace has one angle of the indicator and one of the spindle, which rests",
                ));
        }
        self.channels.push(channel);
        self.first.push(row.place(column));
        Ok(self.channels.len() - 1)
    }
}

/// Two readings of the same channel, repeat, direction, time and position are one too many.
fn refuse_duplicates(
    table: &TableReader,
    found: &Found,
    readings: &[DesignReading],
    lines: &[usize],
) -> Result<(), Message> {
    let mut seen: HashMap<(usize, u32, bool, u64, u64), usize> = HashMap::new();
    for (r, line) in readings.iter().zip(lines) {
        // Adding zero makes −0 and 0 one position.
        let (time, x) = (
            (r.time.unwrap_or(0.0) + 0.0).to_bits(),
            (r.x + 0.0).to_bits(),
        );
        let backward = r.direction == Direction::Backward;
        if let Some(earlier) = seen.insert((r.channel, r.repeat, backward, time, x), *line) {
            let name = &found.channels[r.channel].name;
            let what = format!(
                "channel {name} at x = {} mm was read in line {earlier} already",
                r.x
            );
            return Err(table
                .at_line(*line, what)
                .remedy("remove one of the two, or number repeats in a column `repeat`"));
        }
    }
    Ok(())
}

/// The readings as those of the four channels.
fn as_four(data: &DesignData, channels: &[Channel]) -> ReversalData {
    let mut first = [const { None }; 4];
    for (channel, place) in channels.iter().zip(&data.first) {
        first[channel.index()] = Some(place.clone());
    }
    let reading = |r: &DesignReading| Reading {
        channel: channels[r.channel],
        repeat: r.repeat,
        direction: r.direction,
        time: r.time,
        x: r.x,
        value: r.value,
    };
    ReversalData {
        observations: Observations {
            readings: data.observations.readings.iter().map(reading).collect(),
        },
        dialect: data.dialect,
        layout: data.layout,
        ignored: Vec::new(),
        gaps: data.gaps,
        first,
    }
}
