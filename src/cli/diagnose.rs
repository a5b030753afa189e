//! `errsep diagnose`: where the gap between model and readings lies, which effect causes it and how
//! far it shrinks.

use std::fmt::Write;
use std::path::PathBuf;

use errsep_models::model::{Effect, FittedModel};
use errsep_models::reversal::diagnosable::{Assumptions, FirstOrder};

use super::{Answer, CommonArgs, progress};
use crate::diagnosis::{Diagnosis, Kind, Options, TabulatedEffects, Trials, diagnose_with, prove};
use crate::io::reversal::{ColumnMap, ReversalSetup, read};
use crate::io::{CsvTable, Message, SetupFile, Status};
use crate::report::diagnosis as sheet;
use crate::report::number::{measured, plain, probability};

/// Where does the gap between model and machine lie, which effect causes it, how far does it
/// shrink?
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example: errsep diagnose readings.csv --out diagnosis
         errsep diagnose readings.csv --without taper --prove 200

A file for --effects has one table an effect:

    [[effect]]
    name = \"coolant\"
    signature = [[0.0, 0.0], [100.0, 1.0], [300.0, 1.0]]   # mm, change of the reading
    channels = { 1A = 1.0, 1B = -1.0 }                     # absent: 1 for all
    turns_with_direction = false
    repeats = [2]                                          # absent: all")]
pub struct Args {
    /// The readings.
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// The set-up.
    #[arg(long, value_name = "SETUP.toml")]
    setup: Option<PathBuf>,
    /// Names and units of the columns, as role=column:unit,...
    #[arg(long, value_name = "ROLE=COLUMN:UNIT,...")]
    columns: Option<ColumnMap>,
    /// Leave an effect out of the catalogue; may be given several times.
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    /// Add the effects of this file (tables of signatures) to the catalogue.
    #[arg(long, value_name = "EFFECTS.toml")]
    effects: Option<PathBuf>,
    /// Probability of naming anything where nothing is there.
    #[arg(long, value_name = "P", default_value_t = 0.01)]
    false_alarm: f64,
    /// Put N sealed effects and none into these data, diagnose them blind, and say how often it
    /// was right.
    #[arg(long, value_name = "N")]
    prove: Option<usize>,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Diagnoses the readings.
///
/// # Errors
/// The files are bad, an effect's name is unknown, or the readings leave nothing over to diagnose.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let mut setup = match &args.setup {
        Some(path) => ReversalSetup::read(path)?,
        None => ReversalSetup::default(),
    };
    if let Some(columns) = &args.columns {
        setup.columns = columns.clone();
    }
    if !(args.false_alarm > 0.0 && args.false_alarm < 0.5) {
        return Err(Message::bad_input(format!(
            "a false-alarm probability of {} cannot be",
            args.false_alarm
        ))
        .remedy("give a number between 0 and 0.5, such as 0.01"));
    }
    let data = read(&args.data, &setup.columns)?;
    let assumptions = Assumptions {
        convention: setup.convention,
        thickness: setup.thickness,
        noise: setup.noise,
    };
    let model = FirstOrder::new(&data.observations, assumptions)
        .map_err(|e| Message::bad_input(e.to_string()).in_file(&args.data))?;
    let catalogue = catalogue(args, &model)?;
    let known: Vec<String> = catalogue.iter().map(|e| e.name().to_owned()).collect();
    if let Some(name) = args.without.iter().find(|n| !known.contains(n)) {
        return Err(Message::bad_input(format!("there is no effect `{name}`"))
            .remedy(format!("the catalogue has {}", known.join(", "))));
    }
    let options = Options {
        false_alarm: args.false_alarm,
        seed: args.common.seed,
        without: args.without.clone(),
        ..Options::default()
    };
    let bar = progress("diagnosing", None);
    let diagnosis = diagnose_with(&model, catalogue, &options);
    bar.finish_and_clear();
    let mut notes = Vec::new();
    if !model.timed {
        notes.push("No times are given: the readings are taken to follow each other evenly, first spindle position first, each repeat forward and then backward.".to_owned());
    }
    if model.left_out > 0 {
        notes.push(format!(
            "{} readings are at positions that not every trace has, and were not used.",
            model.left_out
        ));
    }
    let own = self::catalogue(args, &model)?;
    let trials = args.prove.map(|count| {
        let bar = progress("proving", None);
        // The trials are made on readings without what was found in them.
        let clean = model.refit(model.observed() - diagnosis.detail.change());
        let trials = prove(&clean, &own, &options, count);
        bar.finish_and_clear();
        trials
    });
    let mut answer = answer(args, &model, diagnosis, notes, trials.as_ref())?;
    answer.text = format!(
        "{}: {}\n\n{}",
        args.data.display(),
        data.in_words(),
        answer.text
    );
    Ok(answer)
}

/// The model's effects and the user's own.
fn catalogue(args: &Args, model: &FirstOrder) -> Result<Vec<Box<dyn Effect<FirstOrder>>>, Message> {
    let mut catalogue = model.effects();
    let Some(path) = &args.effects else {
        return Ok(catalogue);
    };
    let own: TabulatedEffects = SetupFile::read(path)?.parse()?;
    let channels = model.channel_names();
    for effect in own.effect {
        let known = catalogue.iter().any(|e| e.name() == effect.name);
        let fault = if known {
            Some(format!("`{}` is in the catalogue already", effect.name))
        } else {
            effect.fault(&channels)
        };
        if let Some(what) = fault {
            return Err(Message::bad_input(what)
                .in_file(path)
                .remedy("give every effect a new name, growing positions and known channels"));
        }
        catalogue.push(Box::new(effect));
    }
    Ok(catalogue)
}

fn answer(
    args: &Args,
    model: &FirstOrder,
    mut diagnosis: Diagnosis,
    notes: Vec<String>,
    trials: Option<&Trials>,
) -> Result<Answer, Message> {
    diagnosis.notes.extend(notes);
    let mut json = serde_json::to_value(&diagnosis)
        .map_err(|e| Message::bad_input(format!("the diagnosis cannot be written as JSON: {e}")))?;
    let mut text = in_words(&diagnosis);
    let mut view = view(args, model, &diagnosis);
    if let Some(trials) = trials {
        text += &proof_in_words(trials);
        view.trials = Some(sheet::Trials {
            truths: trials.truths.clone(),
            answers: trials.answers.clone(),
            counts: trials.counts.clone(),
        });
        if let serde_json::Value::Object(object) = &mut json {
            object.insert("proof".to_owned(), serde_json::json!(trials));
        }
    }
    let mut inputs = vec![args.data.clone()];
    inputs.extend(args.setup.clone());
    inputs.extend(args.effects.clone());
    let places = model.places();
    let numbers = |value: fn(&errsep_models::model::Place) -> f64| -> Vec<f64> {
        places.iter().map(value).collect()
    };
    let residuals = CsvTable::new("residuals.csv")
        .numbers("channel", numbers(|p| p.channel as f64 + 1.0))
        .numbers("repeat", numbers(|p| f64::from(p.repeat)))
        .numbers("direction", numbers(|p| p.direction))
        .numbers("x_mm", numbers(|p| p.x))
        .numbers("before_um", diagnosis.detail.before.clone())
        .numbers("after_um", diagnosis.detail.after.clone());
    Ok(Answer {
        text,
        json,
        page: sheet::page(&view),
        tables: vec![residuals],
        inputs,
        seed: Some(args.common.seed),
        status: Status::Done,
    })
}

/// µrad for people; other units as they are.
fn shown(value: f64, unit: &str) -> (f64, &str) {
    if unit == "rad" {
        (value * 1e6, "urad")
    } else {
        (value, unit)
    }
}

fn in_words(diagnosis: &Diagnosis) -> String {
    let gap = &diagnosis.gap;
    let mut text = format!("{}\n\n", diagnosis.verdict.statement);
    let _ = writeln!(
        text,
        "Gap, {} RMS          {:.4} [{:.4}, {:.4}] -> {:.4} [{:.4}, {:.4}]   noise of one reading {:.4}",
        gap.unit,
        gap.before.rms,
        gap.before.ci95[0],
        gap.before.ci95[1],
        gap.after.rms,
        gap.after.ci95[0],
        gap.after.ci95[1],
        gap.noise
    );
    if let Some(held) = gap.held_out {
        let _ = writeln!(
            text,
            "On held-out repeats   {:.4} -> {:.4}   (a perfect model: {:.4})",
            held.before, held.after, held.floor
        );
    }
    if !diagnosis.places.is_empty() {
        let _ = writeln!(
            text,
            "\nWhere                                              share   p"
        );
    }
    for place in &diagnosis.places {
        let range = match (place.from, place.to) {
            (Some(from), Some(to)) => format!(" {} to {}", plain(from, 4), plain(to, 4)),
            _ => String::new(),
        };
        let _ = writeln!(
            text,
            "  {:<48} {:>5.1} %  {}",
            format!("{} {}{range}", place.axis, place.value),
            100.0 * place.share,
            probability(place.p_value)
        );
    }
    let _ = writeln!(
        text,
        "\nEffect                     explains          p   visible  parameters"
    );
    for candidate in &diagnosis.candidates {
        let parameters: Vec<String> = candidate
            .parameters
            .iter()
            .map(|p| {
                let (value, unit) = shown(p.value, &p.unit);
                format!(
                    "{} {} {unit}",
                    p.name,
                    measured(value, Some(shown(p.std, &p.unit).0))
                )
            })
            .collect();
        let mark = if candidate.in_set { "*" } else { " " };
        let shown = if candidate.p_value < 0.05 {
            parameters.join(", ")
        } else {
            String::new()
        };
        let _ = writeln!(
            text,
            "{mark} {:<24} {:>6.1} %   {:>8}  {:>5.1} %  {shown}",
            candidate.effect,
            100.0 * candidate.explained,
            probability(candidate.p_value),
            100.0 * candidate.visible
        );
    }
    if diagnosis.verdict.kind == Kind::Effect {
        let _ = writeln!(text, "\nBias of the answer        without        with");
        for bias in &diagnosis.bias {
            let (before, unit) = shown(bias.before, &bias.unit);
            let (after, _) = shown(bias.after, &bias.unit);
            let (moved, _) = shown(bias.moved, &bias.unit);
            let _ = writeln!(
                text,
                "  {:<12} {before:>14.4} {after:>14.4} {unit}   moved {moved:.4} +/- {:.4}",
                bias.quantity,
                shown(bias.std, &bias.unit).0
            );
        }
    }
    let _ = writeln!(text, "\nWhat could still hide");
    for hidden in &diagnosis.hidden {
        let detectable = hidden.detectable.map_or_else(
            || "would not show whatever its size".to_owned(),
            |d| {
                let (value, unit) = shown(d, &hidden.unit);
                format!("would show from {value:.4} {unit}")
            },
        );
        let _ = writeln!(
            text,
            "  {:<24} {detectable} ({:.1} % visible)",
            hidden.effect,
            100.0 * hidden.visible
        );
    }
    for note in &diagnosis.notes {
        let _ = writeln!(text, "\nNote: {note}");
    }
    text
}

fn proof_in_words(trials: &Trials) -> String {
    let all: usize = trials.counts.iter().flatten().sum();
    let mut text = format!(
        "\nPut into these readings and diagnosed blind: {all} times, {} right, {} named wrong\n",
        trials.right, trials.wrong
    );
    for (truth, row) in trials.truths.iter().zip(&trials.counts) {
        let said: Vec<String> = trials
            .answers
            .iter()
            .zip(row)
            .filter(|(_, count)| **count > 0)
            .map(|(answer, count)| format!("{answer} {count}"))
            .collect();
        let _ = writeln!(text, "  {truth:<24} {}", said.join(", "));
    }
    text
}

fn view(args: &Args, model: &FirstOrder, diagnosis: &Diagnosis) -> sheet::View {
    let size = |s: crate::diagnosis::Size| sheet::Size {
        rms: s.rms,
        ci95: s.ci95,
    };
    let channels = model.channel_names();
    let gap = &diagnosis.gap;
    sheet::View {
        data: args.data.display().to_string(),
        finding: match diagnosis.verdict.kind {
            Kind::None => sheet::Finding::None,
            Kind::Effect => sheet::Finding::Effect,
            Kind::Unknown => sheet::Finding::Unknown,
        },
        statement: diagnosis.verdict.statement.clone(),
        gap: sheet::Gap {
            unit: gap.unit.to_owned(),
            noise: gap.noise,
            before: size(gap.before),
            after: size(gap.after),
            shrink: gap.shrink,
            held_out: gap.held_out.map(|h| (h.before, h.after)),
        },
        places: diagnosis.places.iter().map(place).collect(),
        candidates: diagnosis.candidates.iter().map(candidate).collect(),
        groups: groups(diagnosis),
        residuals: model
            .places()
            .iter()
            .zip(diagnosis.detail.before.iter().zip(&diagnosis.detail.after))
            .map(|(p, (before, after))| sheet::Residual {
                panel: channels.get(p.channel).cloned().unwrap_or_default(),
                row: format!(
                    "{} {}",
                    p.repeat,
                    if p.direction > 0.0 {
                        "forward"
                    } else {
                        "backward"
                    }
                ),
                x: p.x,
                before: *before,
                after: *after,
            })
            .collect(),
        x: ("slide position".to_owned(), "mm".to_owned()),
        shifts: diagnosis.bias.iter().map(shift).collect(),
        profiles: diagnosis
            .detail
            .profiles
            .iter()
            .map(|(name, before, after)| sheet::Profile {
                name: name.clone(),
                x: model.positions().to_vec(),
                before: before.clone(),
                after: after.clone(),
            })
            .collect(),
        hidden: diagnosis.hidden.iter().map(hidden).collect(),
        warnings: diagnosis.notes.clone(),
        trials: None,
    }
}

fn place(place: &crate::diagnosis::Where) -> sheet::Place {
    let range = match (place.from, place.to) {
        (Some(from), Some(to)) => format!(", {from:.4} to {to:.4}"),
        _ => String::new(),
    };
    sheet::Place {
        axis: place.axis.to_owned(),
        value: format!("{}{range}", place.value),
        share: place.share,
        p_value: place.p_value,
    }
}

fn candidate(candidate: &crate::diagnosis::Candidate) -> sheet::Candidate {
    sheet::Candidate {
        effect: candidate.effect.clone(),
        explained: candidate.explained,
        p_value: candidate.p_value,
        evidence: candidate.evidence,
        visible: candidate.visible,
        named: candidate.in_set,
        parameters: candidate
            .parameters
            .iter()
            .map(|p| {
                let (value, unit) = shown(p.value, &p.unit);
                (
                    p.name.clone(),
                    value,
                    shown(p.std, &p.unit).0,
                    unit.to_owned(),
                )
            })
            .collect(),
        physics: candidate.physics.clone(),
        confirm: candidate.confirm.clone(),
    }
}

fn groups(diagnosis: &Diagnosis) -> Vec<sheet::Group> {
    diagnosis
        .verdict
        .indistinguishable
        .iter()
        .map(|names| sheet::Group {
            effects: names.clone(),
            separate: diagnosis
                .candidates
                .iter()
                .filter(|c| names.contains(&c.effect))
                .map(|c| c.confirm.clone())
                .collect::<Vec<_>>()
                .join("; or "),
        })
        .collect()
}

fn shift(bias: &crate::diagnosis::Bias) -> sheet::Shift {
    let (before, unit) = shown(bias.before, &bias.unit);
    sheet::Shift {
        quantity: bias.quantity.clone(),
        before,
        after: shown(bias.after, &bias.unit).0,
        std: shown(bias.std, &bias.unit).0,
        unit: unit.to_owned(),
    }
}

fn hidden(hidden: &crate::diagnosis::Hidden) -> sheet::Hidden {
    sheet::Hidden {
        effect: hidden.effect.clone(),
        visible: hidden.visible,
        detectable: hidden.detectable.map(|d| {
            let (value, unit) = shown(d, &hidden.unit);
            (value, unit.to_owned())
        }),
        harm: hidden.harm.as_ref().map_or(String::new(), |h| {
            let (value, unit) = shown(h.per_unit, &h.unit);
            format!("{value:.3} {unit} in {} per {}", h.quantity, hidden.unit)
        }),
    }
}
