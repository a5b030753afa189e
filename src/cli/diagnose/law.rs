//! A gap that no effect explains, as a formula (`--law`).

use std::fmt::Write;
use std::path::Path;

use errsep_models::model::{AnyModel, FittedModel};
use serde_json::{Value, json};

use super::Args;
use super::learnt::{explained, named, seen, without_causes};
use super::words::number;
use crate::cli::progress;
use crate::diagnosis::{
    Diagnosis, Kind, Law, LawFound, LawTerm, NoLaw, Options, Power, for_people, law, written,
};
use crate::io::{Message, OutFile};
use crate::report::number::{measured, percent, plain, probability};

/// Laws put into the noise to say how often one of the gap's size would have been found.
const INJECTIONS: usize = 40;
/// The name of a law that is in no file.
const NAME: &str = "law";
/// Rivals that are told in words.
const RIVALS: usize = 4;

/// What the search for a law says, and whether what was asked for could be given.
pub(super) struct Sought {
    /// In words, and as JSON.
    pub said: (String, Value),
    /// Whether a file was wanted and there is no law to write.
    pub is_missing: bool,
}

/// Seeks a law in what is left, and writes it where a file is named.
///
/// # Errors
/// There are no repeats to hold out; the file cannot be written.
pub(super) fn sought(
    model: &AnyModel,
    args: &Args,
    file: Option<(&Path, OutFile)>,
    diagnosis: &Diagnosis,
    options: &Options,
) -> Result<Sought, Message> {
    if let Some(why) = not_sought(diagnosis) {
        return Ok(Sought {
            is_missing: file.is_some(),
            said: (
                format!("\nNo law is sought: {why}.{}\n", not_written(file.as_ref())),
                json!({"found": false, "why": why, "nearest": null, "tried": null, "power": null}),
            ),
        });
    }
    let name = match &file {
        Some((place, _)) => named(place, model)?,
        None => NAME.to_owned(),
    };
    let bar = progress("seeking a law", None);
    let found = law(model, options, INJECTIONS);
    bar.finish_and_clear();
    let found = found.map_err(|why| {
        Message::not_determined(why.to_string())
            .in_file(&args.data)
            .remedy("measure at least two repeats, better four: a law is chosen on some and accepted on the others")
    })?;
    match found {
        LawFound::None(none) => Ok(Sought {
            is_missing: file.is_some(),
            said: (
                format!("{}{}\n", without_law(&none), not_written(file.as_ref())),
                no_law(&none),
            ),
        }),
        LawFound::Law(mut law) => {
            law.effect.name.clone_from(&name);
            law.effect.seen = Some(seen(model, args)?);
            let mut text = in_words(model, &law);
            let mut answer = as_json(model, &law);
            if let Some((place, file)) = file {
                let heading: Vec<String> = text.lines().map(str::to_owned).collect();
                file.write(written(&law.effect, model, &heading).as_bytes())?;
                let _ = write!(
                    text,
                    "\nWritten to {}. To test it on another campaign of the same kind: errsep diagnose OTHER.csv --effects {}",
                    place.display(),
                    place.display()
                );
                if let Value::Object(object) = &mut answer {
                    object.insert("file".to_owned(), json!(place.display().to_string()));
                }
            }
            Ok(Sought {
                is_missing: false,
                said: (format!("\n{text}\n"), answer),
            })
        }
    }
}

/// Why no law is sought: it would be one of noise, or of what an effect explains.
fn not_sought(diagnosis: &Diagnosis) -> Option<String> {
    match diagnosis.verdict.kind {
        Kind::Unknown => None,
        Kind::None => Some("nothing stands out of the noise".to_owned()),
        Kind::Effect => Some(format!(
            "{}; to seek one all the same: {}",
            explained(diagnosis),
            without_causes(diagnosis)
        )),
    }
}

/// The formula as it is read again.
fn formula(law: &Law) -> &str {
    law.effect.formula.as_ref().map_or("", |f| f.text())
}

fn as_json(model: &AnyModel, law: &Law) -> Value {
    json!({
        "found": true,
        "effect": law.effect.name,
        "formula": formula(law),
        "channels": law.effect.channels,
        "terms": law.terms,
        "rms": law.rms,
        "unit": model.reading_unit(),
        "false_alarm": {"noise": law.p_value, "smooth": 1.0 / law.odds.max(1.0), "tried": law.tried},
        "held_out": {"explained": law.explained, "confirmed": law.confirmed},
        "adequacy": law.adequacy,
        "rivals": law.rivals,
    })
}

fn no_law(none: &NoLaw) -> Value {
    json!({
        "found": false,
        "why": none.why,
        "nearest": none.nearest,
        "tried": none.tried,
        "power": none.power,
    })
}

fn forms(tried: [usize; 2]) -> String {
    format!(
        "{} forms of one term and {} of two were tried",
        tried[0], tried[1]
    )
}

fn in_words(model: &AnyModel, law: &Law) -> String {
    let unit = for_people(model.reading_unit());
    let mut text = format!(
        "Law `{}`: {}{}, {} {unit} RMS.",
        law.effect.name,
        formula(law),
        match law.effect.channels.len() {
            0 => String::new(),
            _ => format!(
                " in {}",
                law.terms
                    .first()
                    .map_or("", |t| { t.pattern.split(',').next().unwrap_or_default() })
            ),
        },
        number(law.rms)
    );
    for term in &law.terms {
        let _ = write!(text, "\n  {}", term_in_words(term));
    }
    let below = |p: f64| {
        let p = probability(p);
        p.strip_prefix('<')
            .map_or(p.clone(), |p| format!("less than {}", p.trim_start()))
    };
    let _ = write!(
        text,
        "\nIt predicts {} of the gap (squared) in repeats that it was not chosen on ({} standard deviations).",
        percent(law.explained),
        plain(law.confirmed, 2)
    );
    let _ = write!(
        text,
        "\n{}; noise alone would show as much with a probability of {}, a smooth error that is no law of {}.",
        forms(law.tried),
        below(law.p_value),
        below(1.0 / law.odds.max(1.0))
    );
    if !law.rivals.is_empty() {
        let _ = write!(text, "\nAs good on held-out repeats, but less simple:");
        for rival in law.rivals.iter().take(RIVALS) {
            let _ = write!(text, "\n  {}", rival.formula);
        }
        if law.rivals.len() > RIVALS {
            let _ = write!(text, "\n  and {} more", law.rivals.len() - RIVALS);
        }
    }
    text += "\nWhat the model absorbs cannot be told: the law is right but for that.";
    text
}

fn term_in_words(term: &LawTerm) -> String {
    let of = term
        .along
        .map_or(String::new(), |along| format!(" of the {along}"));
    let sizes: Vec<String> = term
        .parameters
        .iter()
        .map(|p| {
            let unit = if p.unit.is_empty() || p.unit == "1" {
                String::new()
            } else {
                format!(" {}", for_people(&p.unit))
            };
            format!("{} {}{unit}", p.name, measured(p.value, Some(p.std)))
        })
        .collect();
    format!(
        "{}{of}, {}: {}",
        term.function,
        term.pattern,
        sizes.join(", ")
    )
}

fn without_law(none: &NoLaw) -> String {
    let mut text = format!("\nNo simple law: {} ({}).", none.why, forms(none.tried));
    if let Some(nearest) = &none.nearest {
        let _ = write!(text, " The nearest is {nearest}.");
    }
    if let Some(power) = &none.power {
        let _ = write!(text, "\n{}", power_in_words(power));
    }
    text
}

/// That the file which was asked for is not there.
fn not_written(file: Option<&(&Path, OutFile)>) -> String {
    file.map_or(String::new(), |(place, _)| {
        format!(" {} is not written.", place.display())
    })
}

fn power_in_words(power: &Power) -> String {
    format!(
        "Of {} laws of this size that were put into the noise {} were found: the probability is {} (95 %: {} to {}).",
        power.draws,
        power.found,
        percent(power.probability),
        percent(power.ci95[0]),
        percent(power.ci95[1])
    )
}
