//! A straight calibration line.

use std::path::Path;

use errsep_models::calibration_line::{CalibrationLine, CalibrationReading, LackOfFit};
use errsep_models::model::{AnyModel, FittedModel};
use serde::Deserialize;

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::io::{ColumnMap, Message, SetupFile, TableReader};
use crate::report::number::{counted, plain, probability};

/// The set-up.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Setup {
    #[serde(default)]
    line: LineSetup,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct LineSetup {
    /// Standard deviation of one reading, in the unit of y.
    noise: Option<f64>,
}

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let setup: Setup = match &args.setup {
        Some(path) => SetupFile::read(path)?.parse()?,
        None => Setup::default(),
    };
    super::positive(setup.line.noise, "[line] noise", args)?;
    let readings = read(&args.data, &args.columns.map())?;
    let noise = setup.line.noise;
    let model = fitted(&readings, noise, args)?;
    let mut notes = vec![
        "x and y are in the units of their columns; sizes of effects are in the unit of y."
            .to_owned(),
    ];
    if !model.timed {
        notes.push("No times are given: the readings are taken to follow each other evenly in the order of the file.".to_owned());
    }
    if let Some(test) = model.lack_of_fit(&[]) {
        notes.push(format!(
            "The classical test of a straight line: {}",
            test_in_words(&test)
        ));
    }
    Case {
        readings: format!(
            "{} in {}",
            counted(readings.len(), "reading"),
            counted(model.traces().len(), "set")
        ),
        model: AnyModel::new(&model),
        along: "x",
        notes,
        inputs: Vec::new(),
    }
    .answer_with(args, |plan| {
        Some(
            read(&plan.data, &plan.columns.map())
                .and_then(|readings| fitted(&readings, noise, plan))
                .map(|model| AnyModel::new(&model)),
        )
    })
}

fn fitted(
    readings: &[CalibrationReading],
    noise: Option<f64>,
    args: &Args,
) -> Result<CalibrationLine, Message> {
    CalibrationLine::new(readings, noise).map_err(|e| {
        Message::bad_input(e.to_string())
            .in_file(&args.data)
            .remedy("give finite readings at four or more values of x")
    })
}

fn test_in_words(test: &LackOfFit) -> String {
    format!(
        "lack of fit F = {} with {} and {} degrees of freedom (p {}), scatter of readings of the same x {}, residuals {}.",
        plain(test.f, 5),
        test.freedom[0],
        test.freedom[1],
        probability(test.p_value),
        plain(test.pure_error, 4),
        plain(test.residual, 4)
    )
}

/// Columns x and y, in units of their own, and where they apply set and time.
fn read(path: &Path, map: &ColumnMap) -> Result<Vec<CalibrationReading>, Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&["x", "y", "set", "time"])?;
    let (x, y) = (
        table.column("x")?.as_written(),
        table.column("y")?.as_written(),
    );
    let (set, time) = (table.optional("set"), table.optional("time"));
    let mut readings = Vec::new();
    while let Some(row) = table.next_row()? {
        readings.push(CalibrationReading {
            x: row.number(&x)?,
            y: row.number(&y)?,
            set: set.as_ref().map_or(Ok(1), |column| row.count(column))?,
            time: time.as_ref().map(|column| row.number(column)).transpose()?,
        });
    }
    if readings.is_empty() {
        return Err(table.no_rows());
    }
    Ok(readings)
}
