//! Which model the readings belong to.

use clap::builder::PossibleValuesParser;

use super::{
    Args, calibration_line, circle, four_sensor, fourier, machine, reversal, step_diagonal,
    turning_bar,
};
use crate::cli::Answer;
use crate::io::plates::is_plate;
use crate::io::turning::is_run;
use crate::io::{Message, SetupFile, TableReader};

/// A model that can be diagnosed.
pub(super) struct Model {
    /// Name for `--model`.
    pub name: &'static str,
    /// Tables that only its set-up has.
    pub tables: &'static [&'static str],
    /// Columns of its readings; each entry is one form of the file.
    pub columns: &'static [&'static [&'static str]],
    /// The column of the readings, which a plan has not; none where a plan without readings has nothing to say.
    pub reading: Option<&'static str>,
    /// Reads, fits and diagnoses.
    pub run: fn(&Args) -> Result<Answer, Message>,
}

/// The models, in the order in which they are offered.
pub(super) const MODELS: &[Model] = &[
    Model {
        name: "reversal",
        tables: &["artefact", "indicator", "model", "columns", "channels"],
        columns: &[
            &["channel", "x", "reading"],
            &["indicator", "spindle", "x", "reading"],
            &["x", "1A"],
            &["x", "1B"],
            &["x", "2A"],
            &["x", "2B"],
        ],
        reading: Some("reading"),
        run: reversal::run,
    },
    Model {
        name: "calibration-line",
        tables: &["line"],
        columns: &[&["x", "y"], &["set", "x", "y"]],
        reading: Some("y"),
        run: calibration_line::run,
    },
    Model {
        name: "circle",
        tables: &["circle"],
        columns: &[&["x", "y"], &["repeat", "x", "y"]],
        reading: None,
        run: circle::run,
    },
    Model {
        name: "four-sensor",
        tables: &["sensors", "separation", "parabola"],
        columns: &[&["x", "m1", "m2", "m3", "m4"], &["sensor", "x", "reading"]],
        reading: None,
        run: four_sensor::run,
    },
    Model {
        name: "fourier",
        tables: &["section", "probe", "method"],
        columns: &[&["spacing", "x", "m1", "m2"]],
        reading: None,
        run: fourier::run,
    },
    Model {
        name: MACHINE,
        tables: &["chain", "errors", "part"],
        columns: &[&["part", "point", "axis", "value"]],
        reading: None,
        run: machine::run,
    },
    Model {
        name: "step-diagonal",
        tables: &["test", "assume", "measured"],
        columns: &[&["diagonal", "sequence", "x", "y", "reading"]],
        reading: None,
        run: step_diagonal::run,
    },
    Model {
        name: TURNING_BAR,
        tables: &["bar", "spindle"],
        // A run is told by what other files lack: see `is_run`.
        columns: &[],
        reading: None,
        run: turning_bar::run,
    },
];

const TURNING_BAR: &str = "turning-bar";
const MACHINE: &str = "machine";

/// The model of a bar that turns.
fn of_a_run() -> Option<&'static Model> {
    MODELS.iter().find(|m| m.name == TURNING_BAR)
}

/// The model of parts, whose tables may be those that measuring machines print.
fn of_a_plate() -> Option<&'static Model> {
    MODELS.iter().find(|m| m.name == MACHINE)
}

/// The names that `--model` takes.
pub(super) fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(MODELS.iter().map(|m| m.name))
}

/// The model that is asked for, or the only one that set-up and columns fit.
///
/// # Errors
/// A file cannot be read; none or several fit.
pub(super) fn model(args: &Args) -> Result<&'static Model, Message> {
    if let Some(name) = &args.model {
        let asked = MODELS.iter().find(|m| m.name == name);
        return asked.ok_or_else(|| Message::bad_input(format!("there is no model `{name}`")));
    }
    let tables = args
        .setup
        .as_deref()
        .map(tables_of)
        .transpose()?
        .unwrap_or_default();
    let by_setup: Vec<&Model> = MODELS
        .iter()
        .filter(|m| tables.iter().any(|t| m.tables.contains(&t.as_str())))
        .collect();
    if let [only] = by_setup[..] {
        return Ok(only);
    }
    if let Some(model) = of_a_plate().filter(|_| is_plate(&args.data, &args.columns.map())) {
        return Ok(model);
    }
    let table = TableReader::open_as(&args.data, &args.columns.map())?;
    let found: Vec<&str> = table.bare_names().map(of_known_case).collect();
    if let Some(model) = of_a_run().filter(|_| is_run(&found)) {
        return Ok(model);
    }
    // The longest form that is wholly there: x and y alone are also part of others.
    let length = |model: &Model| {
        model
            .columns
            .iter()
            .filter(|form| form.iter().all(|name| found.contains(name)))
            .map(|form| form.len())
            .max()
            .unwrap_or(0)
    };
    let longest = MODELS.iter().map(length).max().unwrap_or(0);
    let by_columns: Vec<&Model> = MODELS
        .iter()
        .filter(|m| longest > 0 && length(m) == longest)
        .collect();
    match by_columns[..] {
        [only] => Ok(only),
        [] => match nearest(&found) {
            // Its reader says what is missing.
            Some(only) => Ok(only),
            None => Err(unknown(&table)),
        },
        [..] => {
            let names: Vec<&str> = by_columns.iter().map(|m| m.name).collect();
            Err(table
                .in_header(0, format!("the columns fit {}", names.join(" and ")))
                .remedy(format!(
                    "say which it is: --model {}",
                    names.join(" or --model ")
                )))
        }
    }
}

/// The name of a model's column that this one is but for capitals.
fn of_known_case(name: &str) -> &str {
    let forms = MODELS.iter().flat_map(|m| m.columns.iter().copied());
    let known = forms.flat_map(|form| form.iter().copied());
    let mut same = known.filter(|known| known.eq_ignore_ascii_case(name));
    same.next().unwrap_or(name)
}

/// The one model that most of the columns are those of, if it is one alone.
fn nearest(found: &[&str]) -> Option<&'static Model> {
    let share = |model: &Model| {
        let of_form = |form: &&[&str]| {
            let known = form.iter().filter(|name| found.contains(name)).count();
            known as f64 / form.len() as f64
        };
        model.columns.iter().map(of_form).fold(0.0, f64::max)
    };
    let best = MODELS.iter().map(share).fold(0.0, f64::max);
    let mut nearest = MODELS.iter().filter(|m| share(m) >= best);
    match (nearest.next(), nearest.next()) {
        (Some(only), None) if best > 0.5 => Some(only),
        _ => None,
    }
}

fn unknown(table: &TableReader) -> Message {
    let forms: Vec<String> = MODELS
        .iter()
        .map(|m| match m.columns.first() {
            Some(columns) => format!("{} ({})", m.name, columns.join(", ")),
            None => format!("{} (time or spindle, x, reading)", m.name),
        })
        .collect();
    table
        .in_header(0, "the columns are those of no model that can be diagnosed")
        .remedy(format!(
            "name the columns as one of these has them, or say which it is with --model: {}",
            forms.join("; ")
        ))
}

/// Names of the tables and keys at the top of a set-up.
fn tables_of(path: &std::path::Path) -> Result<Vec<String>, Message> {
    let top: toml::Table = SetupFile::read(path)?.parse()?;
    Ok(top.keys().cloned().collect())
}
