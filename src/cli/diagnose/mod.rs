//! `errsep diagnose`: where the gap between model and readings lies, which effect causes it and how
//! far it shrinks. One file wires a model: it reads the data, fits the model and names its axes.
//!
//! To add a model, write its file and add its line to `recognise::MODELS`.

mod calibration_line;
mod case;
mod checked;
mod circle;
mod four_sensor;
mod fourier;
pub(in crate::cli) mod joined;
mod law;
mod learnt;
mod machine;
pub(super) mod page;
mod recognise;
pub(super) mod reversal;
pub(in crate::cli) mod sealed;
mod step_diagonal;
mod turning_bar;
pub(super) mod words;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use errsep_models::model::{AnyModel, FittedModel, Place};

use super::{Answer, ColumnArgs, CommonArgs};
use crate::io::Message;
use crate::io::source::want_digests;

/// Where does the gap between model and machine lie, which effect causes it, how far does it
/// shrink?
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example: errsep diagnose readings.csv --out diagnosis
         errsep diagnose readings.csv --without taper --prove 200
         errsep diagnose parts.csv --setup machine.toml --points points.csv --with thermal-expansion
         errsep diagnose plate-1.txt plate-2.txt --setup cmm.toml

A file for --effects has one table an effect:

    [[effect]]
    name = \"coolant\"
    signature = [[0.0, 0.0], [100.0, 1.0], [300.0, 1.0]]   # mm, change of the reading
    channels = { 1A = 1.0, 1B = -1.0 }                     # absent: 1 for all
    turns_with_direction = false
    repeats = [2]                                          # absent: all

    [[effect]]
    name = \"warm-up\"
    formula = \"1 - exp(-time / 600)\"   # of x, time, direction, repeat, channel, reading

What no effect explains is learnt from one campaign and tested on another:

    errsep diagnose monday.csv --learn coolant.toml
    errsep diagnose friday.csv --effects coolant.toml

A gap that follows a law (powers, exponentials, cosines, steps of position, time or reading) is
told as a formula, or that there is none:

    errsep diagnose monday.csv --law
    errsep diagnose monday.csv --law coolant.toml   # written for --effects

What a further measurement will show is written down before it is made, and scored afterwards:

    errsep diagnose monday.csv --seal next.toml --next plan.csv
    errsep check next.toml friday.csv")]
pub struct Args {
    /// The readings.
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// Further parts, a file each.
    #[arg(value_name = "PART.csv")]
    more: Vec<PathBuf>,
    /// The set-up of the model's own command; for parts the model of the machine.
    #[arg(long, value_name = "SETUP.toml")]
    setup: Option<PathBuf>,
    /// The model, where columns and set-up do not tell it.
    #[arg(long, value_name = "NAME", value_parser = recognise::names())]
    model: Option<String>,
    /// Points of the parts (columns point, x, y and z, mm).
    #[arg(long, value_name = "POINTS.csv")]
    points: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnArgs,
    /// Leave these effects out of the catalogue.
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',')]
    without: Vec<String>,
    /// Seek nothing: fit these effects along with the model, with one covariance, by their names.
    #[arg(
        long,
        value_name = "EFFECT,...",
        value_delimiter = ',',
        conflicts_with_all = ["without", "prove", "false_alarm"]
    )]
    with: Vec<String>,
    /// Add the effects of this file (tables of signatures, formulas, what was learnt) to the catalogue.
    #[arg(long, value_name = "EFFECTS.toml")]
    effects: Option<PathBuf>,
    /// Where no effect explains the gap, write what is left as an effect of its own, for --effects.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "with")]
    learn: Option<PathBuf>,
    /// Where no effect explains the gap, seek a law in it: a formula, written to FILE where one is named.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "with")]
    law: Option<Option<PathBuf>>,
    /// Write what a further measurement is expected to show, before it is made, for `errsep check`.
    #[arg(
        long,
        value_name = "FILE.toml",
        requires = "next",
        conflicts_with = "with"
    )]
    seal: Option<PathBuf>,
    /// The further measurement that --seal is for: the columns of the readings without the readings.
    #[arg(long, value_name = "PLAN.csv", requires = "seal")]
    next: Option<PathBuf>,
    /// Probability of naming anything where nothing is there.
    #[arg(long, value_name = "P", default_value_t = 0.01)]
    false_alarm: f64,
    /// Most rivals of a family that are drawn to say what else would have been given the same name;
    /// 0: none are.
    #[arg(long, value_name = "N", default_value_t = RIVALS)]
    severity: usize,
    /// Put N sealed effects and none into these data, diagnose them blind, and say how often it
    /// was right.
    #[arg(long, value_name = "N")]
    prove: Option<usize>,
    /// What was sealed, to score these readings against in place of a diagnosis.
    #[arg(skip)]
    check: Option<Arc<sealed::SealFile>>,
    /// Noise of a reading that an option of the model's own command states, µm.
    #[arg(skip)]
    noise: Option<f64>,
    /// Length of a section, likewise, mm.
    #[arg(skip)]
    length: Option<f64>,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

impl Args {
    /// The files of the readings.
    fn files(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.data)
            .chain(&self.more)
            .map(PathBuf::as_path)
    }
}

/// Rivals of a family where the user states no number: 38 of them named alike are still below 5 %
/// (Clopper and Pearson).
pub(super) const RIVALS: usize = 1000;

/// Most rivals of a family.
const MOST_RIVALS: usize = 100_000;

/// Most blind trials: each is a diagnosis of its own.
const MOST_TRIALS: usize = 100_000;

/// Diagnoses the readings.
///
/// # Errors
/// The files are bad, the model is not known, an effect's name is unknown, or the readings leave
/// nothing over to diagnose.
pub fn run(args: &Args) -> Result<Answer, Message> {
    if !(args.false_alarm > 0.0 && args.false_alarm < 0.5) {
        return Err(Message::bad_input(format!(
            "a false-alarm probability of {} cannot be",
            args.false_alarm
        ))
        .remedy("give a number between 0 and 0.5, such as 0.01"));
    }
    if let Some(count) = args.prove.filter(|n| !(1..=MOST_TRIALS).contains(n)) {
        return Err(Message::bad_input(if count == 0 {
            "--prove 0 proves nothing".to_owned()
        } else {
            format!("--prove {count} would not come to an end")
        })
        .remedy(format!(
            "give the number of sealed effects, such as --prove 200, at most {MOST_TRIALS}"
        )));
    }
    if args.severity > MOST_RIVALS {
        return Err(Message::bad_input(format!(
            "--severity {} would not come to an end",
            args.severity
        ))
        .remedy(format!(
            "give the number of rivals of a family, such as --severity {RIVALS}, at most {MOST_RIVALS}; 0 draws none"
        )));
    }
    if args.learn.is_some() || args.law.is_some() || args.effects.is_some() || args.seal.is_some() {
        // A learnt effect names the readings that it was learnt from by their digest.
        want_digests();
    }
    let model = recognise::model(args)?;
    if !args.more.is_empty() && model.name != "machine" {
        return Err(Message::bad_input(format!(
            "several files of readings belong to parts, not to {}",
            model.name
        ))
        .in_file(&args.more[0])
        .remedy("diagnose one file at a time"));
    }
    if args.points.is_some() && model.name != "machine" {
        return Err(Message::bad_input(format!(
            "--points belongs to parts, not to {}",
            model.name
        ))
        .remedy("leave it out, or say --model machine"));
    }
    (model.run)(args)
}

/// Scores readings against what was sealed before they were taken, read with these set-up and effects.
///
/// # Errors
/// The readings are bad, or not those that were planned.
pub(super) fn scored(
    data: &Path,
    [setup, effects]: [Option<PathBuf>; 2],
    seal: sealed::SealFile,
    common: &CommonArgs,
) -> Result<Answer, Message> {
    let models = recognise::MODELS.iter();
    let known = models.map(|m| m.name).find(|name| *name == seal.model);
    let model = known.ok_or_else(|| {
        Message::bad_input(format!(
            "the seal is of a `{}`, which is no model",
            seal.model
        ))
        .remedy("score it with the version of errsep that sealed it")
    })?;
    let given = joined::Given {
        setup: setup.as_deref(),
        columns: seal.columns()?,
        ..joined::Given::to(model, data, &[], common)
    };
    let args = Args {
        effects,
        check: Some(Arc::new(seal)),
        ..given.args()
    };
    (recognise::model(&args)?.run)(&args)
}

/// Refuses a standard deviation in the set-up that is not positive.
fn positive(value: Option<f64>, what: &str, args: &Args) -> Result<(), Message> {
    match value {
        Some(v) if !(v > 0.0 && v.is_finite()) => {
            let message = Message::bad_input(format!("{what} = {v} is no standard deviation"))
                .remedy("give a number greater than zero, or leave it out to estimate it");
            Err(in_setup(message, args))
        }
        _ => Ok(()),
    }
}

/// Greatest reading, position and time: the square of a sum of squares of them must be finite.
const GREATEST: f64 = 1e60;

/// Refuses a number whose squares and products no longer fit into a double.
fn within_reach(what: &str, value: f64, at: &str, args: &Args) -> Result<(), Message> {
    within_reach_in(what, value, at, &args.data)
}

/// The same for every reading, position and time of a model; `along`: name of the positions.
pub(super) fn within_reach_of(model: &AnyModel, along: &str, file: &Path) -> Result<(), Message> {
    let at = |place: &Place| format!("{along} = {:e}", place.x);
    for (reading, place) in model.observed().iter().zip(model.places()) {
        within_reach_in("a reading", *reading, &at(place), file)?;
        within_reach_in("a position", place.x, &at(place), file)?;
        within_reach_in("a time", place.time, &at(place), file)?;
    }
    for (left, place) in model.linearised().iter().zip(model.places()) {
        let what = "a reading less what the model makes of it";
        within_reach_in(what, *left, &at(place), file)?;
    }
    Ok(())
}

fn within_reach_in(what: &str, value: f64, at: &str, file: &Path) -> Result<(), Message> {
    if value.abs() <= GREATEST {
        return Ok(());
    }
    Err(Message::bad_input(format!(
        "{what} of {value:e} (at {at}) cannot be diagnosed: its square overflows"
    ))
    .in_file(file)
    .remedy(format!(
        "correct it: readings, positions and times stay below {GREATEST:e}"
    )))
}

/// A message about the set-up, with its file where there is one.
fn in_setup(message: Message, args: &Args) -> Message {
    match &args.setup {
        Some(path) => message.in_file(path),
        None => message,
    }
}
