//! Readings of a positioning test and its set-up.

use std::path::{Path, PathBuf};

use errsep_models::positioning::{Direction, Influences, PositioningError, Reading};
use serde::Deserialize;
use toml::Spanned;

use super::message::{Place, list};
use super::units::{ARCSEC_PER_DEG, LengthUnit};
use super::{Column, ColumnMap, Message, Row, SetupFile, TableReader};

/// Positions beyond this and deviations beyond its thousandfold are a slip of the unit, mm or degrees.
const FARTHEST: f64 = 1e9;

/// What kind of axis was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisKind {
    /// Positions in mm, deviations in µm.
    #[default]
    Linear,
    /// Positions in degrees, deviations in seconds of arc.
    Rotary,
}

impl AxisKind {
    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Rotary => "rotary",
        }
    }

    /// Unit of positions in files.
    pub const fn position_unit(self) -> &'static str {
        match self {
            Self::Linear => "mm",
            Self::Rotary => "deg",
        }
    }

    /// Unit of deviations in files.
    pub const fn deviation_unit(self) -> &'static str {
        match self {
            Self::Linear => "um",
            Self::Rotary => "arcsec",
        }
    }
}

/// The set-up of a positioning test.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PositioningSetup {
    /// Name of the axis.
    pub name: Option<String>,
    /// Kind of the axis.
    pub kind: AxisKind,
    /// Ends of its travel, mm or degrees.
    pub travel: Option<(f64, f64)>,
    /// Unit of positions and targets of a linear axis in the data; mm if absent.
    pub unit: Option<LengthUnit>,
    /// What is known of the measurement.
    pub influences: Influences,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct File {
    axis: AxisTable,
    uncertainty: UncertaintyTable,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct AxisTable {
    name: Option<String>,
    kind: AxisKind,
    travel_from: Option<Spanned<f64>>,
    travel_to: Option<Spanned<f64>>,
    unit: Option<Spanned<String>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct UncertaintyTable {
    device: Option<Spanned<f64>>,
    misalignment: Option<Spanned<f64>>,
    expansion: Option<Spanned<f64>>,
    drift: Option<Spanned<f64>>,
}

impl PositioningSetup {
    /// Reads a set-up.
    ///
    /// # Errors
    /// No TOML, an unknown key, a travel without length or with one end, an uncertainty below zero, a
    /// unit of a rotary axis.
    pub fn read(path: &Path) -> Result<Self, Message> {
        let setup = SetupFile::read(path)?;
        let file: File = setup.parse()?;
        let uncertainty = |value: Option<Spanned<f64>>, name: &str| {
            match value {
            None => Ok(0.0),
            Some(u) if (0.0..=FARTHEST).contains(u.get_ref()) => Ok(*u.get_ref()),
            Some(u) => Err(setup.bad(
                u.span(),
                format!("{name} = {} is no uncertainty", u.get_ref()),
                "give the expanded uncertainty (k = 2) in um, of a rotary axis in arcsec, or leave it out",
            )),
        }
        };
        let unit = file.axis.unit.as_ref().map(|name| {
            let known = LengthUnit::from_name(name.get_ref());
            known
                .filter(|_| file.axis.kind == AxisKind::Linear)
                .ok_or_else(|| {
                    let remedy = match file.axis.kind {
                        AxisKind::Linear => format!("units are {}", list(&LengthUnit::NAMES)),
                        AxisKind::Rotary => {
                            "remove it: positions of a rotary axis are in degrees".to_owned()
                        }
                    };
                    let what = format!("`{}` is no unit of its positions", name.get_ref());
                    setup.bad(name.span(), what, remedy)
                })
        });
        let unit = unit.transpose()?;
        let scale = unit.unwrap_or(LengthUnit::Mm).in_mm();
        let travel = match (&file.axis.travel_from, &file.axis.travel_to) {
            (None, None) => None,
            (Some(from), Some(to)) => {
                let (a, b) = (*from.get_ref() * scale, *to.get_ref() * scale);
                if !(a < b && a.abs() <= FARTHEST && b.abs() <= FARTHEST) {
                    return Err(setup.bad(
                        to.span(),
                        format!("a travel from {a} to {b} cannot be"),
                        "give the lower end as travel_from and the upper as travel_to",
                    ));
                }
                Some((a, b))
            }
            (Some(one), None) | (None, Some(one)) => {
                return Err(setup.bad(
                    one.span(),
                    "the travel has one end",
                    "give both travel_from and travel_to, or neither",
                ));
            }
        };
        Ok(Self {
            name: file.axis.name,
            kind: file.axis.kind,
            travel,
            unit,
            influences: Influences {
                device: uncertainty(file.uncertainty.device, "device")?,
                misalignment: uncertainty(file.uncertainty.misalignment, "misalignment")?,
                expansion: uncertainty(file.uncertainty.expansion, "expansion")?,
                drift: uncertainty(file.uncertainty.drift, "drift")?,
            },
        })
    }
}

/// The readings of a test and where they stand.
#[derive(Debug, Clone, PartialEq)]
pub struct PositioningData {
    /// The readings, targets in mm or degrees, deviations in µm or seconds of arc.
    pub readings: Vec<Reading>,
    /// Least and greatest temperature, °C, where it is told.
    pub temperature: Option<(f64, f64)>,
    file: PathBuf,
    lines: Vec<usize>,
}

impl PositioningData {
    /// What is wrong with the readings, at the row that shows it.
    pub fn refused(&self, error: &PositioningError) -> Message {
        let mut what = error.to_string();
        if let PositioningError::Duplicate { first, .. } = error {
            let line = self.lines.get(*first).copied().unwrap_or_default();
            what += &format!(": the first stands on line {line}");
        }
        let message = Message::bad_input(what).remedy(match error {
            PositioningError::Empty => "give the readings of a test",
            PositioningError::NotFinite { .. } | PositioningError::TooLarge => {
                "check the units of positions and deviations"
            }
            PositioningError::Duplicate { .. } => {
                "number the runs 1, 2, 3, … in the column `run`, or remove one of the rows"
            }
            PositioningError::OneTarget { .. } => {
                "measure two targets or more; ISO 230-2 asks for five in each metre"
            }
            PositioningError::MissingDirection { .. } => {
                "approach every target from both sides, or leave that direction out everywhere"
            }
            PositioningError::OneReading { .. } => {
                "measure the target again from this side, leave it out in all runs, or write nominal positions as targets"
            }
            PositioningError::Apart { .. } => {
                "number the runs 1, 2, 3, … at every target, or give readings that are no runs of one test as files of their own"
            }
        });
        match error.reading().and_then(|r| self.lines.get(r)) {
            None => message.in_file(&self.file),
            Some(line) => message.at(Place {
                file: self.file.clone(),
                line: *line,
                column: 1,
                text: String::new(),
                length: 0,
            }),
        }
    }
}

const COLUMNS: [&str; 7] = [
    "target",
    "run",
    "direction",
    "position",
    "deviation",
    "time",
    "temperature",
];

/// Reads the columns `target` and `position` (in `unit`, or degrees) or `deviation` (µm or seconds of
/// arc), and where they apply `run`, `direction`, `time` (s) and `temperature` (°C). A row of which the position or
/// deviation is empty is a reading that is missing.
///
/// # Errors
/// The table cannot be read, has both `position` and `deviation` or neither, no reading at all, a direction of another
/// name, or a number beyond any axis.
pub fn read_readings(
    path: &Path,
    map: &ColumnMap,
    kind: AxisKind,
    unit: LengthUnit,
) -> Result<PositioningData, Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&COLUMNS)?;
    let columns = Columns::of(&table, kind, unit)?;
    let mut data = PositioningData {
        readings: Vec::new(),
        temperature: None,
        file: path.to_owned(),
        lines: Vec::new(),
    };
    let mut empty = 0;
    while let Some(row) = table.next_row()? {
        if row.is_empty(&columns.value) {
            empty += 1;
            continue;
        }
        data.readings.push(columns.reading(row)?);
        data.lines.push(row.line());
        if let Some(column) = &columns.temperature {
            let now = row.number(column)?;
            let (low, high) = data.temperature.unwrap_or((now, now));
            data.temperature = Some((low.min(now), high.max(now)));
        }
    }
    if data.readings.is_empty() && empty > 0 {
        let what = format!("no reading in {empty} rows");
        return Err(table
            .at_column(&columns.value, what)
            .remedy("fill in the readings; a field that is empty is a reading that is missing"));
    }
    if data.readings.is_empty() {
        return Err(table.no_rows());
    }
    Ok(data)
}

/// What is read from where.
struct Columns {
    target: Column,
    value: Column,
    is_position: bool,
    run: Option<Column>,
    direction: Option<Column>,
    time: Option<Column>,
    temperature: Option<Column>,
    /// mm (degrees) in one of the file's positions.
    position_scale: f64,
    /// µm (seconds of arc) in one mm (degree).
    deviation_scale: f64,
}

impl Columns {
    fn of(table: &TableReader, kind: AxisKind, unit: LengthUnit) -> Result<Self, Message> {
        // Degrees are not converted.
        let length = |column: Column| match kind {
            AxisKind::Linear => column.in_unit(unit),
            AxisKind::Rotary => column,
        };
        let deviation = |column: Column| match kind {
            AxisKind::Linear => column.in_um(),
            AxisKind::Rotary => column,
        };
        let (position, deviation) = (
            table.optional("position").map(length),
            table.optional("deviation").map(deviation),
        );
        let (value, is_position) = match (position, deviation) {
            (Some(position), None) => (position, true),
            (None, Some(deviation)) => (deviation, false),
            (Some(_), Some(both)) => {
                return Err(table
                    .at_column(&both, "there are both `position` and `deviation`")
                    .remedy("keep one of the two: a deviation is the position less its target"));
            }
            (None, None) => (length(table.column("position")?), true),
        };
        let (position_scale, deviation_scale) = match kind {
            AxisKind::Linear => (unit.in_mm(), super::units::UM_PER_MM),
            AxisKind::Rotary => (1.0, ARCSEC_PER_DEG),
        };
        Ok(Self {
            target: length(table.column("target")?),
            value,
            is_position,
            run: table.optional("run"),
            direction: table.optional("direction"),
            time: table.optional("time"),
            temperature: table.optional("temperature"),
            position_scale,
            deviation_scale,
        })
    }

    fn reading(&self, row: Row) -> Result<Reading, Message> {
        let within = |column: &Column, scale: f64, most: f64| {
            let value = scale * row.number(column)?;
            if value.abs() <= most {
                return Ok(value);
            }
            let what = format!("{} {} is beyond any axis", column.name(), row.text(column));
            Err(row
                .error(column, what)
                .remedy("check the unit and the column"))
        };
        let target = within(&self.target, self.position_scale, FARTHEST)?;
        let deviation = if self.is_position {
            let position = within(&self.value, self.position_scale, FARTHEST)?;
            self.deviation_scale * (position - target)
        } else {
            within(&self.value, 1.0, FARTHEST * self.deviation_scale)?
        };
        let direction = match &self.direction {
            None => Direction::Forward,
            Some(column) => Direction::from_name(row.text(column)).ok_or_else(|| {
                row.error(
                    column,
                    format!("direction \"{}\" is unknown", row.text(column)),
                )
                .remedy("write forward (towards greater positions) or backward")
            })?,
        };
        Ok(Reading {
            target,
            run: self.run.as_ref().map_or(Ok(1), |run| row.count(run))?,
            direction,
            deviation,
            time: self
                .time
                .as_ref()
                .map(|time| row.number(time))
                .transpose()?,
        })
    }
}
