//! Runs of a bar that turns while the slide feeds: readings (CSV) and set-up (TOML).

use std::path::Path;

use errsep_models::reversal::turning_bar::{
    Along, HIGHEST_HARMONIC, Plan, Setting, TurningError, TurningReading,
};
use serde::Deserialize;
use serde_json::json;
use toml::Spanned;

use super::units::LengthUnit;
use super::{Column, ColumnMap, Message, SetupFile, TableReader};

/// Columns of a run.
const COLUMNS: [&str; 4] = ["time", "x", "reading", "spindle"];
/// By what other names time and position go in the files of indicators.
const ALSO: [(&str, &str); 2] = [("time", "t"), ("x", "z")];
/// Seconds in a minute.
const MINUTE: f64 = 60.0;

/// A run as read.
#[derive(Debug, Clone)]
pub struct TurningFile {
    /// The readings, in the order of the file.
    pub readings: Vec<TurningReading>,
    /// The line of each.
    lines: Vec<usize>,
}

/// Reads a run.
///
/// # Errors
/// A column is missing or unknown, a field is no number, there is neither a time nor an angle.
pub fn read(path: &Path, map: &ColumnMap) -> Result<TurningFile, Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&["time", "t", "x", "z", "reading", "spindle"])?;
    let found = |role: &'static str| {
        let also = ALSO.iter().find(|(of, _)| *of == role);
        table
            .optional(role)
            .or_else(|| also.and_then(|(_, other)| table.optional(other)))
    };
    let time = found("time").map(Column::in_s);
    let spindle = found("spindle");
    if time.is_none() && spindle.is_none() {
        return Err(table
            .in_header(0, "there is neither a column `time` nor a column `spindle`")
            .remedy(
                "add the time of each reading in seconds, or the angle of the spindle in degrees: \
                 without either nothing tells how the bar turned",
            ));
    }
    let needed = |role: &'static str| match found(role) {
        Some(column) => Ok(column),
        None => table.column(role),
    };
    let (x, reading) = (needed("x")?, needed("reading")?);
    let x_mm = x.length_unit().unwrap_or(LengthUnit::Mm).in_mm();
    let reading_um = reading.length_unit().unwrap_or(LengthUnit::Um).in_um();
    let (x, reading) = (x.as_written(), reading.as_written());
    let mut file = TurningFile {
        readings: Vec::new(),
        lines: Vec::new(),
    };
    while let Some(row) = table.next_row()? {
        let optional =
            |column: &Option<Column>| column.as_ref().map(|column| row.number(column)).transpose();
        file.readings.push(TurningReading {
            time: optional(&time)?,
            x: row.number(&x)? * x_mm,
            value: row.number(&reading)? * reading_um,
            spindle: optional(&spindle)?,
        });
        file.lines.push(row.line());
    }
    if file.readings.is_empty() {
        return Err(table.no_rows());
    }
    Ok(file)
}

impl TurningFile {
    /// What is wrong with the run, where, and what to do.
    pub fn refusal(&self, path: &Path, why: &TurningError) -> Message {
        let time = |i: usize| self.readings.get(i).and_then(|r| r.time);
        let (index, what, remedy) = match why {
            TurningError::Time { index } => {
                let same = *index > 0 && time(*index) == time(*index - 1);
                let what = if same {
                    "this reading has the time of the one before it: no bar has two angles at one time"
                } else {
                    "the time goes back"
                };
                let remedy =
                    "write the readings in the order in which they were taken, each time once";
                (Some(*index), what.to_owned(), remedy)
            }
            TurningError::JumpsBack { index, degrees } => (
                Some(*index),
                format!("the angle of the spindle jumps back by {degrees:.1}°"),
                "write one run in one direction of turning, angles counted through or from 0 to 360 anew each turn",
            ),
            TurningError::SlideBack { index, by_mm } => (
                Some(*index),
                format!("the slide goes back by {by_mm:.4} mm"),
                "give a run in which the slide feeds one way; split the file where it turns back",
            ),
            TurningError::NotFinite { index, .. } => (
                Some(*index),
                why.to_string(),
                "write the number, or remove the row",
            ),
            TurningError::TooFew { .. }
            | TurningError::TooFewTurns { .. }
            | TurningError::TooFewPerTurn { .. }
            | TurningError::TooManyUnknowns { .. } => (
                None,
                why.to_string(),
                "turn faster or feed more slowly: three turns or more, of twenty readings or more each",
            ),
            TurningError::NoTravel { .. } => {
                (None, why.to_string(), "give a run in which the slide feeds")
            }
            TurningError::NoWave => (
                None,
                why.to_string(),
                "give a run in which the bar turns and runs out, and its speed as [spindle] rpm if it is known",
            ),
            _ => (None, why.to_string(), "check the run and its set-up"),
        };
        let unsolved = matches!(
            why,
            TurningError::NotConverged { .. } | TurningError::NoWave
        );
        let mut message = if unsolved {
            Message::not_converged(what)
        } else {
            Message::bad_input(what)
        };
        if let TurningError::NotConverged {
            ending,
            residual_rms_um,
            iterations,
        } = why
        {
            message = message.reaching(json!({
                "residual": {"rms": residual_rms_um, "unit": "um"},
                "convergence": {"converged": false, "reason": ending, "iterations": iterations},
            }));
        }
        message = match index.and_then(|i| self.lines.get(i)) {
            Some(line) => message.at(super::message::Place {
                file: path.to_owned(),
                line: *line,
                column: 1,
                text: String::new(),
                length: 0,
            }),
            None => message.in_file(path),
        };
        message.remedy(remedy)
    }
}

/// What a set-up says of a run.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct File {
    spindle: Spindle,
    indicator: Indicator,
    bar: Bar,
    model: Model,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Spindle {
    turns: Turns,
    rpm: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum Turns {
    #[default]
    Ccw,
    Cw,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Indicator {
    angle: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Bar {
    harmonics: Option<Vec<Spanned<usize>>>,
    along: SectionAlong,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum SectionAlong {
    Constant,
    #[default]
    Linear,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Model {
    form_cells: Option<Spanned<usize>>,
    turn_cells: Option<Spanned<usize>>,
}

/// Reads the set-up of a run.
///
/// # Errors
/// No TOML, an unknown key, a value that cannot be.
pub fn read_setup(path: &Path) -> Result<Plan, Message> {
    let setup = SetupFile::read(path)?;
    let file: File = setup.parse()?;
    let mut setting = Setting::default();
    if let Some(rpm) = &file.spindle.rpm {
        if !(*rpm.as_ref() > 0.0 && rpm.as_ref().is_finite()) {
            return Err(setup.bad(
                rpm.span(),
                format!("{} turns a minute cannot be", rpm.as_ref()),
                "give the speed, or leave it out to have it found",
            ));
        }
        setting.about_hz = Some(rpm.as_ref() / MINUTE);
    }
    if let Some(angle) = &file.indicator.angle {
        if !(angle.as_ref().abs() <= 360.0) {
            return Err(setup.bad(
                angle.span(),
                format!("an indicator at {}° cannot be", angle.as_ref()),
                "give its direction about the spindle axis in degrees: near 0, top 90, far 180, bottom 270",
            ));
        }
        setting.indicator_rad = angle.as_ref().to_radians();
    }
    if let Turns::Cw = file.spindle.turns {
        setting.handed = -1.0;
    }
    if let Some(harmonics) = &file.bar.harmonics {
        for (i, k) in harmonics.iter().enumerate() {
            let twice = harmonics[..i].iter().any(|o| o.as_ref() == k.as_ref());
            if twice || !(2..=HIGHEST_HARMONIC).contains(k.as_ref()) {
                return Err(setup.bad(
                    k.span(),
                    format!("harmonic {} cannot be fitted", k.as_ref()),
                    format!("give whole numbers from 2 to {HIGHEST_HARMONIC}, each once"),
                ));
            }
        }
        setting.harmonics = harmonics.iter().map(|k| *k.as_ref()).collect();
    }
    setting.along = match file.bar.along {
        SectionAlong::Constant => Along::Constant,
        SectionAlong::Linear => Along::Linear,
    };
    let cells = |given: &Option<Spanned<usize>>| match given {
        Some(n) if *n.as_ref() == 0 => Err(setup.bad(
            n.span(),
            "a spline has one cell or more",
            "give 1 or more, or leave it out to have their number chosen",
        )),
        given => Ok(given.as_ref().map(|n| *n.as_ref())),
    };
    Ok(Plan {
        form_cells: cells(&file.model.form_cells)?,
        turn_cells: cells(&file.model.turn_cells)?,
        setting,
    })
}

/// The columns of a run, for those who ask which model a file belongs to.
pub fn is_run(names: &[&str]) -> bool {
    let has = |role: &str| {
        let also = ALSO.iter().find(|(of, _)| *of == role);
        names.contains(&role) || also.is_some_and(|(_, other)| names.contains(other))
    };
    let others = names
        .iter()
        .all(|name| COLUMNS.contains(name) || ALSO.iter().any(|(_, other)| other == name));
    others && has("x") && has("reading") && (has("time") || has("spindle"))
}
