//! Effects that are given with `--with`, fitted along with any model.

use std::fmt::Write;
use std::path::Path;

use serde_json::Value;

use super::case::{Case, catalogue, residuals};
use super::words::{moved, number, shown};
use super::{Args, page, recognise};
use crate::cli::{Answer, ColumnArgs, CommonArgs, progress};
use crate::diagnosis::{Joined, JoinedEffect, NotJoined, Options, for_people, joined};
use crate::io::message::{list, nearest};
use crate::io::{CsvTable, Message, Status};
use crate::report::diagnosis as sheet;
use crate::report::number::probability;

impl Case {
    /// The fit with the effects that are given.
    pub(super) fn with_effects(self, args: &Args) -> Result<(Answer, Joined), Message> {
        let options = Options {
            seed: args.common.seed,
            ..Options::default()
        };
        let bar = progress("fitting", None);
        let fitted = joined(
            &self.model,
            catalogue(args, &self.model)?,
            &args.with,
            &options,
        );
        bar.finish_and_clear();
        let mut fit = fitted.map_err(|why| refused(&why, &args.data))?;
        fit.notes.extend(self.notes);
        let json = serde_json::to_value(&fit)
            .map_err(|e| Message::bad_input(format!("the fit cannot be written as JSON: {e}")))?;
        let names = args.with.join(" and ");
        let view = sheet::View {
            statement: statement(&fit, &names),
            ..page::of_fit(
                args.data.display().to_string(),
                &self.model,
                self.along,
                &fit,
            )
        };
        let answer = Answer {
            text: format!(
                "{}: {}, with {names} in the fit\n\n{}",
                args.data.display(),
                self.readings,
                in_words(&fit, &view.statement)
            ),
            json,
            page: sheet::with_effects(&view),
            tables: vec![residuals(&self.model, &fit.before, &fit.after)],
            inputs: [
                Some(args.data.clone()),
                args.setup.clone(),
                args.effects.clone(),
            ]
            .into_iter()
            .flatten()
            .chain(self.inputs)
            .collect(),
            setup: None,
            seed: Some(args.common.seed),
            status: Status::Done,
        };
        Ok((answer, fit))
    }
}

/// What a model's own command knows of the fit that its effects join.
pub(in crate::cli) struct Given<'a> {
    /// Name of the model.
    pub model: &'static str,
    pub data: &'a Path,
    pub setup: Option<&'a Path>,
    /// The effects.
    pub with: &'a [String],
    /// Standard deviation of a reading, µm, where an option states it.
    pub noise: Option<f64>,
    /// Length of the section, mm, where an option states it.
    pub length: Option<f64>,
    /// Names and units of the columns.
    pub columns: ColumnArgs,
    pub common: &'a CommonArgs,
}

impl<'a> Given<'a> {
    /// Nothing but a model's data and the effects.
    pub fn to(
        model: &'static str,
        data: &'a Path,
        with: &'a [String],
        common: &'a CommonArgs,
    ) -> Self {
        Self {
            model,
            data,
            setup: None,
            with,
            noise: None,
            length: None,
            columns: ColumnArgs::default(),
            common,
        }
    }
}

/// Heading above the fit with effects, behind another answer.
const HEADING: &str = "With the effects in the fit";

/// A command's answer, with the fit that effects have joined behind it: in the text, as `effects` and
/// `with` in the JSON, as sections of the page.
///
/// # Errors
/// The effects are not known, or the readings do not determine them beside the model.
pub(in crate::cli) fn beside(answer: Answer, given: &Given<'_>) -> Result<Answer, Message> {
    if given.with.is_empty() {
        return Ok(answer);
    }
    let args = given.args();
    let joined = (recognise::model(&args)?.run)(&args)?;
    Ok(followed_by(answer, joined))
}

impl Given<'_> {
    /// The same as what `errsep diagnose --with` is given.
    pub(super) fn args(&self) -> Args {
        let given = self;
        Args {
            data: given.data.to_owned(),
            more: Vec::new(),
            setup: given.setup.map(Path::to_owned),
            model: Some(given.model.to_owned()),
            points: None,
            columns: given.columns.clone(),
            without: Vec::new(),
            with: given.with.to_vec(),
            effects: None,
            learn: None,
            law: None,
            seal: None,
            next: None,
            check: None,
            severity: 0,
            false_alarm: Options::default().false_alarm,
            prove: None,
            noise: given.noise,
            length: given.length,
            common: given.common.clone(),
        }
    }
}

/// An answer with that of a fit with effects behind it.
pub(super) fn followed_by(mut answer: Answer, joined: Answer) -> Answer {
    let _ = write!(answer.text, "\n{HEADING}: {}", joined.text);
    if let (Value::Object(object), Value::Object(own)) = (&mut answer.json, joined.json) {
        let effects = own.get("effects").cloned().unwrap_or_default();
        object.insert("effects".to_owned(), effects);
        object.insert("with".to_owned(), Value::Object(own));
    }
    answer.page = answer.page.followed_by(HEADING, joined.page);
    // The command has residuals of its own: those of the fit without the effects.
    answer
        .tables
        .extend(joined.tables.into_iter().map(|table| CsvTable {
            file_name: format!("with_{}", table.file_name),
            ..table
        }));
    answer.seed = joined.seed;
    answer
}

fn refused(why: &NotJoined, file: &Path) -> Message {
    match why {
        NotJoined::NoSuch { name, known } => {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            let near = nearest(name, known.iter().copied());
            Message::bad_input(why.to_string()).remedy(match near {
                Some(near) => format!("did you mean `{near}`? Known are {}", list(&known)),
                None => format!("known are {}", list(&known)),
            })
        }
        NotJoined::Twice(name) => {
            Message::bad_input(why.to_string()).remedy(format!("name {name} once"))
        }
        NotJoined::Absorbed(name) | NotJoined::Nowhere(name) => Message::not_determined(
            why.to_string(),
        )
        .in_file(file)
        .remedy(format!(
            "leave {name} out of --with; `errsep diagnose` says what measurement would show it"
        )),
        NotJoined::Mixed(name) | NotJoined::Undetermined(name) => {
            Message::not_determined(why.to_string())
                .in_file(file)
                .remedy(format!(
                    "leave {name} out of --with, or another of the effects"
                ))
        }
    }
}

fn statement(fit: &Joined, names: &str) -> String {
    let gap = &fit.gap;
    let left = if gap.remains_p < LEFT {
        "something is left that stands out: see errsep diagnose"
    } else {
        "nothing is left that stands out"
    };
    format!(
        "With {names} in the fit the model misses {} in place of {}; {left} (p {}).",
        gap.after.in_words(gap.unit),
        gap.before.in_words(gap.unit),
        probability_in_words(gap.remains_p),
    )
}

/// A remainder less probable than this stands out.
const LEFT: f64 = 0.01;

fn probability_in_words(p: f64) -> String {
    let text = probability(p);
    if text.starts_with('<') {
        text
    } else {
        format!("= {text}")
    }
}

fn in_words(fit: &Joined, statement: &str) -> String {
    let gap = &fit.gap;
    let mut text = format!("{statement}\n\n");
    let _ = writeln!(
        text,
        "Gap, {} RMS           {} -> {}   noise of {} {}",
        for_people(gap.unit),
        gap.before.figures(),
        gap.after.figures(),
        gap.of_what(),
        number(gap.noise)
    );
    if let Some(held) = gap.held_out {
        let _ = writeln!(
            text,
            "On held-out repeats   {} -> {}   (a perfect model: {})",
            number(held.before),
            number(held.after),
            number(held.floor)
        );
    }
    let _ = writeln!(
        text,
        "\nEffect                     visible         p  parameters"
    );
    for effect in &fit.effects {
        let _ = writeln!(
            text,
            "  {:<24} {:>5.1} %  {:>8}  {}",
            title(effect),
            100.0 * effect.visible,
            probability(effect.p_value),
            parameters(effect).join(", ")
        );
    }
    if !fit.quantities.is_empty() {
        let _ = writeln!(text, "\nAnswer                    without        with");
    }
    for bias in &fit.quantities {
        let value = |value: f64, std: f64| {
            let (value, unit) = shown(value, &bias.unit);
            let (std, _) = shown(std, &bias.unit);
            (crate::report::number::measured(value, Some(std)), unit)
        };
        let (before, unit) = value(bias.before, bias.std);
        let (after, _) = value(bias.after, bias.after_std);
        let _ = writeln!(
            text,
            "  {:<18} {before:>18} {after:>18} {unit}   {}",
            bias.quantity,
            moved(bias).in_words()
        );
    }
    for note in &fit.notes {
        let _ = writeln!(text, "\nNote: {note}");
    }
    text
}

fn title(effect: &JoinedEffect) -> String {
    match &effect.variant {
        Some(variant) => format!("{} ({variant})", effect.effect),
        None => effect.effect.clone(),
    }
}

fn parameters(effect: &JoinedEffect) -> Vec<String> {
    let told = effect.parameters.iter().map(|p| {
        let told = p.told();
        if told.std.is_finite() {
            told.in_words()
        } else {
            format!(
                "{} {} {} (not bounded)",
                told.name,
                number(told.value),
                told.unit
            )
        }
    });
    told.collect()
}
