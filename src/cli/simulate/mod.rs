//! `errsep simulate`: data with known truth, one file a kind.

pub mod anova;
pub mod calibration_line;
pub mod circle;
mod designs;
pub mod four_sensor;
pub mod fourier;
pub mod machine;
pub mod positioning;
pub mod reversal;
mod sizes;
pub mod step_diagonal;
pub mod turning_bar;

use std::fmt::Write;
use std::path::Path;

use clap::Subcommand;
use errsep_models::model::Parameter;
use serde_json::{Value, json};

use super::answer::SETUP;
use super::{Answer, CommonArgs};
use crate::io::message::nearest;
use crate::io::output::Values;
use crate::io::{CsvTable, Message, Status};
use crate::report;

/// Makes data with known truth.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Debug, Subcommand)]
enum Kind {
    Anova(anova::Args),
    CalibrationLine(calibration_line::Args),
    Circle(circle::Args),
    FourSensor(four_sensor::Args),
    Fourier(fourier::Args),
    Machine(machine::Args),
    Positioning(positioning::Args),
    Reversal(reversal::Args),
    StepDiagonal(step_diagonal::Args),
    TurningBar(turning_bar::Args),
}

impl Args {
    pub(super) fn common(&self) -> &CommonArgs {
        match &self.kind {
            Kind::Anova(args) => &args.common,
            Kind::CalibrationLine(args) => &args.common,
            Kind::Circle(args) => &args.common,
            Kind::FourSensor(args) => &args.common,
            Kind::Fourier(args) => &args.common,
            Kind::Machine(args) => &args.common,
            Kind::Positioning(args) => &args.common,
            Kind::Reversal(args) => &args.common,
            Kind::StepDiagonal(args) => &args.common,
            Kind::TurningBar(args) => &args.common,
        }
    }
}

/// Simulates the kind that was asked for.
///
/// # Errors
/// What makes no sense in the kind's options.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let mut answer = match &args.kind {
        Kind::Anova(args) => anova::run(args),
        Kind::CalibrationLine(args) => calibration_line::run(args),
        Kind::Circle(args) => circle::run(args),
        Kind::FourSensor(args) => four_sensor::run(args),
        Kind::Fourier(args) => fourier::run(args),
        Kind::Machine(args) => machine::run(args),
        Kind::Positioning(args) => positioning::run(args),
        Kind::Reversal(args) => reversal::run(args),
        Kind::StepDiagonal(args) => step_diagonal::run(args),
        Kind::TurningBar(args) => turning_bar::run(args),
    }?;
    if let Some(folder) = &args.common().out {
        answer.text = summary(&answer, folder);
    }
    Ok(answer)
}

/// What was made, for people who find the data themselves in the folder.
fn summary(answer: &Answer, folder: &Path) -> String {
    let kind = answer.json["kind"].as_str().unwrap_or_default();
    let mut text = format!(
        "Simulated {kind}, seed {}\n",
        answer.seed.unwrap_or_default()
    );
    for table in &answer.tables {
        let rows = match table.columns.first() {
            Some((_, column)) => column.len(),
            None => 0,
        };
        let _ = writeln!(text, "  {}: {rows} rows", table.file_name);
    }
    if let (Some(_), Some(data)) = (&answer.setup, answer.tables.first()) {
        let _ = writeln!(
            text,
            "  {SETUP}: the set-up; next: errsep {kind} {} --setup {}",
            folder.join(&data.file_name).display(),
            folder.join(SETUP).display()
        );
    }
    let truth = known_in_a_line(&answer.json["truth"]);
    let _ = writeln!(text, "  truth: {truth} (whole in result.json)");
    text
}

/// The single numbers of a truth with their units; the names alone of what is longer.
fn known_in_a_line(truth: &Value) -> String {
    let Value::Object(truth) = truth else {
        return truth.to_string();
    };
    let parts: Vec<String> = truth
        .iter()
        .map(|(name, what)| match (what, &what["value"]) {
            (Value::Number(number), _) => format!("{name} {number}"),
            (_, Value::Number(number)) => {
                let unit = what["unit"].as_str().unwrap_or_default();
                format!("{name} {number} {unit}").trim_end().to_owned()
            }
            _ => name.clone(),
        })
        .collect();
    parts.join(", ")
}

/// Most readings that a kind without a bound of its own simulates.
const MOST_READINGS: usize = 10_000_000;

/// Refuses a standard deviation that is none: `sizes` are options with their values.
pub(super) fn standard_deviations(sizes: &[(&str, f64)]) -> Result<(), Message> {
    for (option, value) in sizes {
        if !(value.is_finite() && *value >= 0.0) {
            return Err(
                Message::bad_input(format!("{option} {value} is no standard deviation"))
                    .remedy(format!("give {option} a finite number, zero or greater")),
            );
        }
    }
    Ok(())
}

/// The seed of one repeat: that of the command for the first.
pub(super) fn seed_of(seed: u64, repeat: usize) -> u64 {
    seed ^ ((repeat as u64) << 40)
}

/// Refuses more readings than are simulated: their number is the product of `counts`, which
/// `options` set.
pub(super) fn few_enough(counts: &[usize], options: &str) -> Result<(), Message> {
    let product = counts.iter().fold(1_usize, |n, c| n.saturating_mul(*c));
    if product <= MOST_READINGS {
        return Ok(());
    }
    Err(Message::bad_input("that many readings are not simulated")
        .remedy(format!("give ten million at most: lower {options}")))
}

/// The effects that are switched on, by what `make` knows of a name and a size, each of a size that its
/// parameter in the catalogue, `parameter` by its name, can have.
pub(super) fn effects<E>(
    texts: &[String],
    known: &[&str],
    parameter: impl Fn(&str) -> Option<Parameter>,
    mut make: impl FnMut(&str, f64) -> Option<E>,
) -> Result<Vec<E>, Message> {
    let example = known.first().copied().unwrap_or("NAME");
    texts
        .iter()
        .map(|text| {
            let bad = |what: String| {
                Message::bad_input(what).remedy(format!(
                    "give --effect as NAME=VALUE, such as --effect {example}=1e-3"
                ))
            };
            let (name, value) = text
                .split_once('=')
                .ok_or_else(|| bad(format!("`{text}` is not NAME=VALUE")))?;
            let (name, value) = (name.trim(), value.trim());
            let size = value
                .parse()
                .ok()
                .filter(|v: &f64| v.is_finite())
                .ok_or_else(|| bad(format!("`{value}` is not a number")))?;
            sizes::possible(name, size, parameter(name).as_ref())?;
            make(name, size).ok_or_else(|| not_made(name, known, parameter(name).is_some()))
        })
        .collect()
}

/// A message about an effect that is none of those that are made, `known`; `diagnosed`: the catalogue of the
/// diagnosis has it.
pub(super) fn not_made(name: &str, known: &[&str], diagnosed: bool) -> Message {
    let known_here = format!("there are {}", known.join(", "));
    if diagnosed {
        return Message::bad_input(format!(
            "`{name}` is an effect of errsep diagnose that this simulation does not make"
        ))
        .remedy(known_here);
    }
    let remedy = match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`? T{}", &known_here[1..]),
        None => known_here,
    };
    Message::bad_input(format!("there is no effect `{name}`")).remedy(remedy)
}

/// Columns in which a reading may be missing: the time where none is told, and what the second and
/// third probe cannot reach.
const MAY_BE_MISSING: [&str; 3] = ["time", "m2", "m3"];

/// Refuses simulated data in which a number has overflowed.
pub(super) fn finite(data: &CsvTable) -> Result<(), Message> {
    let beyond = data.columns.iter().find(|(name, values)| match values {
        Values::Numbers(v) => {
            let may_be_missing = MAY_BE_MISSING.contains(&name.as_str());
            !v.iter()
                .all(|x| x.is_finite() || (may_be_missing && x.is_nan()))
        }
        Values::Texts(_) | Values::Words(..) => false,
    });
    if let Some((name, _)) = beyond {
        return Err(Message::bad_input(format!(
            "these sizes make a {name} that is no finite number"
        ))
        .remedy("give sizes nearer to those of a machine"));
    }
    Ok(())
}

/// A simulation as every kind answers: the data as text in the form that the commands read, with its
/// truth in comments; data and truth as JSON.
pub(super) fn answer(
    kind: &str,
    data: CsvTable,
    truth: Value,
    seed: u64,
) -> Result<Answer, Message> {
    finite(&data)?;
    let unwritable = |e: String| Message::bad_input(format!("the data cannot be written: {e}"));
    let mut bytes = Vec::new();
    data.write(&mut bytes)
        .map_err(|e| unwritable(e.to_string()))?;
    let table = String::from_utf8(bytes).map_err(|e| unwritable(e.to_string()))?;
    let columns = data
        .columns
        .iter()
        .map(|(name, values)| {
            let values = match values {
                Values::Numbers(v) => json!(
                    v.iter()
                        .map(|x| if x.is_nan() { Value::Null } else { json!(x) })
                        .collect::<Vec<_>>()
                ),
                Values::Texts(v) => json!(v),
                Values::Words(words, v) => json!(
                    v.iter()
                        .map(|w| words.get(usize::from(*w)))
                        .collect::<Vec<_>>()
                ),
            };
            (name.clone(), values)
        })
        .collect::<serde_json::Map<String, Value>>();
    let rows = data.columns.first().map_or(0, |(_, values)| values.len());
    let page = report::simulation::page(kind, seed, (&data.file_name, rows), &truth);
    Ok(Answer {
        text: format!("# errsep simulate {kind} --seed {seed}\n{table}"),
        json: json!({
            "schema": "errsep.simulation/1",
            "kind": kind,
            "seed": seed,
            "truth": truth,
            "data": columns,
        }),
        page,
        tables: vec![data],
        inputs: Vec::new(),
        setup: None,
        seed: Some(seed),
        status: Status::Done,
    })
}

/// Adds the set-up with which the data are read: a comment above printed data, a file of a folder. The
/// noise goes into the table `of_noise`; readings without noise are told of none.
pub(super) fn add_setup(answer: &mut Answer, mut setup: String, of_noise: &str, noise: f64) {
    if noise > 0.0 {
        if !setup.contains(&format!("[{of_noise}]")) {
            let _ = writeln!(setup, "[{of_noise}]");
        }
        let _ = writeln!(setup, "noise = {noise:?}");
    }
    let in_a_line = setup.trim_end().replace('\n', " ");
    answer
        .text
        .insert_str(0, &format!("# set-up: {in_a_line}\n"));
    answer.setup = Some(setup);
}
