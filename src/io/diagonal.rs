//! Readings of diagonal and step-diagonal tests and their set-up.

use std::path::Path;

use errsep_models::diagonal::{
    Component, Diagonal, DiagonalReading, Sequence, Target, Travel, WorkZone, check,
};
use errsep_models::uncertainty::DegreesOfFreedom;
use serde::Deserialize;
use toml::Spanned;

use super::message::list;
use super::{Column, ColumnMap, Message, SetupFile, TableReader};

/// The set-up of a step-diagonal test.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiagonalSetup {
    /// The instrument.
    #[serde(default)]
    pub test: TestSetup,
    /// What is taken from elsewhere.
    #[serde(default)]
    pub assume: AssumeSetup,
    /// Positioning slopes measured by other means.
    #[serde(default)]
    pub measured: Vec<MeasuredSetup>,
}

/// `[test]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestSetup {
    /// `mirror` or `retro-reflector`, for data without the column.
    pub target: Option<Target>,
    /// Standard deviation of one reading, µm.
    pub noise: Option<Spanned<f64>>,
}

impl TestSetup {
    /// The standard deviation of one reading, µm, where it is stated.
    pub fn noise_um(&self) -> Option<f64> {
        self.noise.as_ref().map(|noise| *noise.get_ref())
    }
}

/// `[assume]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AssumeSetup {
    /// ISO 230-1 names of errors taken as zero.
    #[serde(default)]
    pub zero: Vec<Spanned<String>>,
}

/// `[[measured]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredSetup {
    /// Axis.
    pub axis: errsep_models::diagonal::Axis,
    /// Positioning slope by end points, µm/mm.
    pub slope: Spanned<f64>,
    /// Its standard uncertainty, µm/mm.
    pub std: Spanned<f64>,
    /// How well that is known; absent: infinite.
    pub degrees_of_freedom: Option<DegreesOfFreedom>,
}

impl DiagonalSetup {
    /// Reads the set-up and the errors it takes as zero.
    ///
    /// # Errors
    /// Those of [`SetupFile`]; a name that is no error function; a standard deviation or uncertainty
    /// that is not greater than zero, or a number that is not finite.
    pub fn read(path: &Path) -> Result<(Self, Vec<Component>), Message> {
        let file = SetupFile::read(path)?;
        let setup: Self = file.parse()?;
        let positive = |value: &Spanned<f64>, what: &str| {
            let number = *value.get_ref();
            if number > 0.0 && number.is_finite() {
                return Ok(());
            }
            Err(file.bad(
                value.span(),
                format!("{what} is {number}: it must be greater than zero and finite"),
                "give the value, or remove the line where it is not known",
            ))
        };
        if let Some(noise) = &setup.test.noise {
            positive(noise, "the noise of a reading")?;
        }
        for measured in &setup.measured {
            positive(
                &measured.std,
                "the standard uncertainty of a measured slope",
            )?;
            if !measured.slope.get_ref().is_finite() {
                return Err(file.bad(
                    measured.slope.span(),
                    format!("the measured slope is {}", measured.slope.get_ref()),
                    "give the slope in um/mm",
                ));
            }
        }
        let mut zero = Vec::new();
        for name in &setup.assume.zero {
            zero.push(Component::from_name(name.get_ref()).ok_or_else(|| {
                let known: Vec<String> = Component::all().map(Component::name).collect();
                file.bad(
                    name.span(),
                    format!("`{}` is no error function", name.get_ref()),
                    format!("write one of {}", known.join(", ")),
                )
            })?);
        }
        Ok((setup, zero))
    }
}

/// Reads the readings: columns `diagonal`, `sequence`, `x`, `y`, `reading`, and where they apply `z`,
/// `repeat`, `direction` and `target`; the work zone is the box that the positions fill.
///
/// # Errors
/// The table cannot be read, a name is unknown, the positions make no grid, or a reading is no stop
/// of its run or repeats one.
pub fn read_readings(
    path: &Path,
    map: &ColumnMap,
    target: Option<Target>,
) -> Result<(WorkZone, Vec<DiagonalReading>), Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&[
        "diagonal",
        "sequence",
        "target",
        "repeat",
        "direction",
        "x",
        "y",
        "z",
        "reading",
    ])?;
    let diagonal = table.column("diagonal")?;
    let sequence = table.column("sequence")?;
    let (x, y) = (table.column("x")?.in_mm(), table.column("y")?.in_mm());
    let reading = table.column("reading")?.in_um();
    let (z, repeat) = (
        table.optional("z").map(Column::in_mm),
        table.optional("repeat"),
    );
    let own_target = table.optional("target");
    let direction = table.optional("direction");
    let mut rows = Vec::new();
    while let Some(row) = table.next_row()? {
        let unknown = |column, what: &str, known: &[&str]| {
            row.error(
                column,
                format!("{what} \"{}\" is not known", row.text(column)),
            )
            .remedy(format!("write one of {}", list(known)))
        };
        let along = Diagonal::from_name(row.text(&diagonal))
            .ok_or_else(|| unknown(&diagonal, "diagonal", &Diagonal::ALL.map(Diagonal::name)))?;
        let order = Sequence::from_name(row.text(&sequence)).ok_or_else(|| {
            unknown(
                &sequence,
                "sequence",
                &[
                    "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "XY", "YX", "together",
                ],
            )
        })?;
        let on_tool = match &own_target {
            Some(column) => match row.text(column) {
                "mirror" => Target::Mirror,
                "retro-reflector" => Target::RetroReflector,
                _ => return Err(unknown(column, "target", &["mirror", "retro-reflector"])),
            },
            None => target.unwrap_or(Target::Mirror),
        };
        let travel = match &direction {
            Some(column) => Travel::from_name(row.text(column))
                .ok_or_else(|| unknown(column, "direction", &Travel::ALL.map(Travel::name)))?,
            None => Travel::Forward,
        };
        let position = [
            row.number(&x)?,
            row.number(&y)?,
            z.as_ref().map_or(Ok(0.0), |z| row.number(z))?,
        ];
        let number = repeat.as_ref().map_or(Ok(1), |c| row.count(c))?;
        let value = row.number(&reading)?;
        let read = DiagonalReading {
            diagonal: along,
            target: on_tool,
            sequence: order,
            repeat: number,
            travel,
            at: [0; 3],
            value,
        };
        rows.push((row.line(), position, read));
    }
    if rows.is_empty() {
        return Err(table.no_rows());
    }
    let mut travel = [0.0; 3];
    let mut least = [0.0; 3];
    let mut steps = 0;
    for a in 0..3 {
        let mut stops: Vec<f64> = rows.iter().map(|r| r.1[a]).collect();
        stops.sort_by(f64::total_cmp);
        let (low, high) = (
            stops.first().copied().unwrap_or(0.0),
            stops.last().copied().unwrap_or(0.0),
        );
        stops.dedup_by(|a, b| (*a - *b).abs() <= 1e-6 * (high - low));
        travel[a] = high - low;
        least[a] = low;
        steps = steps.max(stops.len() - 1);
    }
    let zone = WorkZone { travel, steps };
    let mut lines = Vec::with_capacity(rows.len());
    let mut readings = Vec::with_capacity(rows.len());
    for (line, position, mut reading) in rows {
        for a in 0..3 {
            if travel[a] > 0.0 {
                let place = (position[a] - least[a]) / travel[a] * steps as f64;
                if (place - place.round()).abs() > 1e-3 {
                    let axis = ["x", "y", "z"][a];
                    return Err(table
                        .at_line(
                            line,
                            format!(
                                "{axis} = {} mm is no stop of a grid of {steps} even steps",
                                position[a]
                            ),
                        )
                        .remedy("use the same number of even steps on every axis"));
                }
                reading.at[a] = place.round() as usize;
            }
        }
        lines.push(line);
        readings.push(reading);
    }
    check(&zone, &readings).map_err(|e| match e.at_reading() {
        Some((index, what)) => table
            .at_line(lines.get(index).copied().unwrap_or(0), what)
            .remedy("each run visits the stops of its diagonal in its sequence, each once"),
        None => Message::bad_input(e.to_string())
            .in_file(path)
            .remedy("give the positions in mm, the same number of even steps on every axis"),
    })?;
    Ok((zone, readings))
}
