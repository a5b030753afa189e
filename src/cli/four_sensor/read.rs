//! Reading the outputs: tidy (`sensor,x,reading`) or wide (`x,m1,m2,m3,m4`), with repeats or without.

use std::path::Path;

use errsep_models::four_sensor::{Geometry, Outputs, Parabola};

use super::gather::{Cell, Gathered, Missing, gather};
use super::setup::Setup;
use crate::io::message::Place;
use crate::io::{ColumnMap, Message, TableReader};

/// Outputs and what their repeats say of the noise.
#[derive(Debug)]
pub(in crate::cli) struct Measured {
    pub outputs: Outputs,
    /// Each repeat by itself.
    pub each: Vec<Outputs>,
    /// Number of repeats that were averaged.
    pub repeats: usize,
    /// Standard deviation of the averaged reading from the scatter of the repeats, µm.
    pub noise: Option<f64>,
    /// Degrees of freedom of that.
    pub freedom: usize,
    /// Readings of single repeats that are missing.
    pub missing: Vec<Missing>,
    /// Where what is missing would have to stand.
    lines: Vec<usize>,
}

impl Measured {
    /// Refuses readings that are missing, for what looks at each repeat by itself.
    pub(in crate::cli) fn whole(&self, path: &Path) -> Result<(), Message> {
        let Some((missing, line)) = self.missing.iter().zip(&self.lines).next() else {
            return Ok(());
        };
        let what = format!(
            "sensor {} has no reading at {} mm in repeat {}, and causes are sought in each repeat by itself",
            missing.sensor, missing.x, missing.repeat
        );
        let remedy = format!("measure it again, or leave out repeat {}", missing.repeat);
        Err(Message::bad_input(what).remedy(remedy).at(Place {
            file: path.to_owned(),
            line: *line,
            column: 1,
            text: String::new(),
            length: 0,
        }))
    }
}

/// One reading and its line.
pub(super) struct Reading {
    pub sensor: usize,
    pub repeat: u32,
    pub x: f64,
    /// None where the field is empty.
    pub value: Option<f64>,
    pub line: usize,
}

pub(in crate::cli) fn read(
    path: &Path,
    map: &ColumnMap,
    setup: &Setup,
) -> Result<Measured, Message> {
    let mut table = TableReader::open_as(path, map)?;
    let readings = if table.optional("sensor").is_some() {
        tidy(&mut table)?
    } else {
        wide(&mut table)?
    };
    if readings.is_empty() {
        return Err(table.no_rows());
    }
    let positions = positions(&readings);
    let step = step(&table, &readings, &positions)?;
    // A zero that is stated for all repeats is known no better than they agree.
    let zeroed = !matches!(setup.settings.parabola, Parabola::ZeroAdjustment(_));
    let Gathered {
        cells,
        repeats,
        variances,
        missing,
        lines,
    } = gather(&table, &readings, &positions, zeroed)?;

    let multiples = multiples(setup, step)?;
    let geometry = Geometry::new(step, multiples, positions.len()).map_err(|error| {
        Message::bad_input(error.to_string())
            .in_file(path)
            .remedy("measure at more slide positions, or check the spacing in the set-up")
    })?;
    let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    let rows = cells
        .iter()
        .map(|cell| std::array::from_fn(|sensor| mean(&cell[sensor])))
        .collect();
    let scatter = scatter(&cells, repeats, zeroed, missing.len());
    let outputs = Outputs::new(geometry, positions[0], rows)
        .map_err(|error| Message::bad_input(error.to_string()).in_file(path))?
        .with_variances(variances);
    let each = (0..repeats)
        .map(|repeat| {
            let rows = cells
                .iter()
                .map(|cell| std::array::from_fn(|sensor| cell[sensor][repeat]))
                .collect();
            Outputs::new(geometry, positions[0], rows)
        })
        .collect::<Result<_, _>>()
        .map_err(|error| Message::bad_input(error.to_string()).in_file(path))?;
    Ok(Measured {
        outputs,
        each,
        repeats,
        // Repeats that agree to the last digit say nothing of the noise.
        noise: scatter.map(|s| s.0).filter(|noise| *noise > 0.0),
        freedom: scatter.map_or(0, |s| s.1),
        missing,
        lines,
    })
}

/// Standard deviation of the averaged reading by the scatter of the repeats, µm, and its degrees of freedom; where sensors may be
/// zeroed anew before each repeat about the height of each. What was filled in for `missing` readings lies where the
/// others have it and adds nothing.
fn scatter(cells: &[Cell], repeats: usize, zeroed: bool, missing: usize) -> Option<(f64, usize)> {
    let heights = usize::from(zeroed);
    let freedom = 4 * repeats.saturating_sub(1) * (cells.len() - heights);
    let freedom = freedom.saturating_sub(missing);
    let mut squares = 0.0;
    for sensor in 0..4 {
        let apart = |cell: &Cell, repeat: usize| {
            let mean = cell[sensor].iter().sum::<f64>() / repeats as f64;
            cell[sensor][repeat] - mean
        };
        for repeat in 0..repeats {
            let all = || cells.iter().map(|cell| apart(cell, repeat));
            let height = match zeroed {
                true => all().sum::<f64>() / cells.len() as f64,
                false => 0.0,
            };
            squares += all().map(|a| (a - height).powi(2)).sum::<f64>();
        }
    }
    (freedom > 0).then(|| ((squares / freedom as f64 / repeats as f64).sqrt(), freedom))
}

fn tidy(table: &mut TableReader) -> Result<Vec<Reading>, Message> {
    table.only(&["sensor", "x", "reading", "repeat"])?;
    let (sensor, at, value) = (
        table.column("sensor")?,
        table.column("x")?.in_mm(),
        table.column("reading")?.in_um(),
    );
    let repeat = table.optional("repeat");
    let mut readings = Vec::new();
    while let Some(row) = table.next_row()? {
        let name = row.text(&sensor);
        let Some(index) = ["1", "2", "3", "4"].iter().position(|known| *known == name) else {
            return Err(row
                .error(&sensor, format!("sensor is \"{name}\""))
                .remedy("number the sensors 1, 2, 3 and 4"));
        };
        readings.push(Reading {
            sensor: index,
            repeat: repeat
                .as_ref()
                .map_or(Ok(1), |column| repeat_number(&row, column))?,
            x: row.number(&at)?,
            value: match row.is_empty(&value) {
                true => None,
                false => Some(row.number(&value)?),
            },
            line: row.line(),
        });
    }
    Ok(readings)
}

fn wide(table: &mut TableReader) -> Result<Vec<Reading>, Message> {
    const SENSORS: [&str; 4] = ["m1", "m2", "m3", "m4"];
    table.only(&["x", "m1", "m2", "m3", "m4", "repeat"])?;
    let at = table.column("x")?.in_mm();
    let mut sensors = Vec::new();
    for name in SENSORS {
        sensors.push(table.column(name)?.in_um());
    }
    let repeat = table.optional("repeat");
    let mut readings = Vec::new();
    while let Some(row) = table.next_row()? {
        let x = row.number(&at)?;
        let repeat = repeat
            .as_ref()
            .map_or(Ok(1), |column| repeat_number(&row, column))?;
        for (index, column) in sensors.iter().enumerate() {
            readings.push(Reading {
                sensor: index,
                repeat,
                x,
                value: match row.is_empty(column) {
                    true => None,
                    false => Some(row.number(column)?),
                },
                line: row.line(),
            });
        }
    }
    Ok(readings)
}

fn repeat_number(row: &crate::io::Row<'_>, column: &crate::io::Column) -> Result<u32, Message> {
    row.text(column)
        .parse()
        .ok()
        .filter(|n| *n > 0)
        .ok_or_else(|| {
            row.error(column, format!("repeat is \"{}\"", row.text(column)))
                .remedy("number the repeats 1, 2, 3 …")
        })
}

fn positions(readings: &[Reading]) -> Vec<f64> {
    let mut positions: Vec<f64> = readings.iter().map(|reading| reading.x).collect();
    positions.sort_by(f64::total_cmp);
    positions.dedup();
    positions
}

/// The sampling interval: the outputs of one sensor have to meet the places of another.
fn step(table: &TableReader, readings: &[Reading], positions: &[f64]) -> Result<f64, Message> {
    let [first, .., last] = positions else {
        return Err(table
            .at_line(
                readings.first().map_or(1, |r| r.line),
                "all readings stand at one position",
            )
            .remedy("measure at equally spaced positions"));
    };
    let mut gaps: Vec<f64> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_by(f64::total_cmp);
    // The usual gap names the place of the unusual one; the mean is the step to calculate with.
    let usual = gaps[gaps.len() / 2];
    if let Some(place) = positions
        .windows(2)
        .position(|pair| (pair[1] - pair[0] - usual).abs() > 1e-3 * usual)
    {
        let x = positions[place + 1];
        let line = readings.iter().find(|r| r.x == x).map_or(1, |r| r.line);
        return Err(table
            .at_line(
                line,
                format!(
                    "position {x} mm is {} mm from the one before, the others are {usual} mm apart",
                    x - positions[place]
                ),
            )
            .remedy("measure at equally spaced positions, without gaps"));
    }
    Ok((last - first) / (positions.len() - 1) as f64)
}

fn multiples(setup: &Setup, step: f64) -> Result<[usize; 3], Message> {
    let mut multiples = [0; 3];
    for (multiple, spacing) in multiples.iter_mut().zip(&setup.spacing.get_ref().0) {
        let steps = spacing / step;
        // A millionth of the largest index is room enough for any real file.
        if (steps - steps.round()).abs() > 0.01 || !(0.5..1e6).contains(&steps) {
            return Err(setup.file.bad(
                setup.spacing.span(),
                format!("a spacing of {spacing} mm is no multiple of the step of {step} mm"),
                "move the slide by a step that divides all spacings",
            ));
        }
        *multiple = steps.round() as usize;
    }
    Ok(multiples)
}
