//! A gap that no effect explains, learnt as an effect (`--learn`), and learnt effects on other readings.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use errsep_models::model::{AnyModel, FittedModel};
use serde_json::{Value, json};

use super::Args;
use super::words::number;
use crate::cli::progress;
use crate::diagnosis::{
    Diagnosis, HeldOutAlong, Kind, Learnt, NotLearnt, Options, Seen, Tabulated, Tested, for_people,
    learn, tested, written,
};
use crate::io::source::{Read256, digest_of};
use crate::io::{Message, OutFile};
use crate::report::number::{percent, plain, probability};

/// Learns what is left and writes it; what is said of it, in words and as JSON.
///
/// # Errors
/// The verdict is not `unknown`, or the readings do not tell what the gap is bound to; the file cannot be
/// written.
pub(super) fn learnt(
    model: &AnyModel,
    args: &Args,
    (place, file): (&Path, OutFile),
    diagnosis: &Diagnosis,
    options: &Options,
) -> Result<(String, Value), Message> {
    only_unknown(args, diagnosis, "--learn")?;
    let name = named(place, model)?;
    let bar = progress("learning", None);
    let found = learn(model, options);
    bar.finish_and_clear();
    let mut learnt = found.map_err(|why| refused(&why, &args.data))?;
    learnt.effect.name.clone_from(&name);
    learnt.effect.seen = Some(seen(model, args)?);
    let said = in_words(model, &learnt);
    let heading: Vec<String> = said.lines().map(str::to_owned).collect();
    file.write(written(&learnt.effect, model, &heading).as_bytes())?;
    let json = json!({
        "effect": name,
        "file": place.display().to_string(),
        "along": learnt.along,
        "curves": learnt.effect.curve.len(),
        "rms": learnt.rms,
        "unit": model.reading_unit(),
        "held_out": learnt.ways,
        "confirmed": learnt.confirmed,
        "adequacy": learnt.adequacy,
    });
    let text = format!(
        "\n{said}\nWritten to {}. To test it on another campaign of the same kind: errsep diagnose OTHER.csv --effects {}\n",
        place.display(),
        place.display()
    );
    Ok((text, json))
}

/// Refuses what is only for a gap that no effect explains.
pub(super) fn only_unknown(
    args: &Args,
    diagnosis: &Diagnosis,
    option: &str,
) -> Result<(), Message> {
    let refused = |what: String, remedy: String| {
        Err(Message::not_determined(what)
            .in_file(&args.data)
            .remedy(remedy))
    };
    match diagnosis.verdict.kind {
        Kind::Unknown => Ok(()),
        Kind::None => refused(
            match option {
                "--learn" => "there is no gap to learn: nothing stands out of the noise".to_owned(),
                _ => "there is no gap to find a law in: nothing stands out of the noise".to_owned(),
            },
            format!("leave {option} out; more repeats show smaller gaps"),
        ),
        Kind::Effect => {
            let names = diagnosis.verdict.effects.join(" and ");
            let without: Vec<String> = diagnosis
                .verdict
                .causes()
                .concat()
                .iter()
                .map(|effect| format!("--without {effect}"))
                .collect();
            let explain = match diagnosis.verdict.effects.len() {
                1 => "explains",
                _ => "explain",
            };
            refused(
                match option {
                    "--learn" => format!("{names} {explain} the gap, so there is nothing to learn"),
                    _ => format!("{names} {explain} the gap, so no law is sought in it"),
                },
                match option {
                    "--learn" => format!(
                        "leave --learn out, or learn it nevertheless with {}",
                        without.join(" ")
                    ),
                    _ => format!(
                        "leave {option} out, or seek one nevertheless with {}",
                        without.join(" ")
                    ),
                },
            )
        }
    }
}

/// The effect's name: that of its file.
pub(super) fn named(place: &Path, model: &AnyModel) -> Result<String, Message> {
    let stem = place.file_stem().map(|stem| stem.to_string_lossy());
    let name = stem.unwrap_or_default().trim().to_owned();
    let known = model.effects();
    if !name.is_empty() && !known.iter().any(|e| e.name() == name) {
        return Ok(name);
    }
    Err(Message::bad_input(format!(
        "a learnt effect is called like its file, and `{name}` is an effect of the catalogue"
    ))
    .in_file(place)
    .remedy("give the file another name, such as coolant.toml"))
}

/// Where an effect was seen; of parts in several files their names and digests in turn.
///
/// # Errors
/// The file changed while it was read.
pub(super) fn seen(model: &AnyModel, args: &Args) -> Result<Seen, Message> {
    let (mut files, mut digests) = (Vec::new(), Vec::new());
    for file in args.files() {
        let Read256::Digest(sha256) = digest_of(file) else {
            return Err(Message::bad_input("the file changed while it was read")
                .in_file(file)
                .remedy("run the command again when nothing writes to the file"));
        };
        files.push(file.display().to_string());
        digests.push(sha256);
    }
    let channels: BTreeSet<usize> = model.places().iter().map(|p| p.channel).collect();
    let names = model.channel_names();
    let repeats: BTreeSet<u32> = model.places().iter().map(|p| p.repeat).collect();
    Ok(Seen {
        model: model.name().to_owned(),
        file: files.join(", "),
        sha256: digests.join(" "),
        channels: channels
            .into_iter()
            .filter_map(|k| names.get(k).cloned())
            .collect(),
        repeats: repeats.into_iter().collect(),
        date: today(),
    })
}

/// The day by universal time, year-month-day (H. Hinnant, *chrono-compatible low-level date algorithms*,
/// `civil_from_days`).
pub(super) fn today() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let days = since.map_or(0, |d| d.as_secs() / 86_400) + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let shifted = (5 * of_year + 2) / 153;
    let day = of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = year + 400 * era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

fn refused(why: &NotLearnt, data: &Path) -> Message {
    let message = Message::not_determined(why.to_string()).in_file(data);
    message.remedy(match why {
        NotLearnt::NoRepeats => "measure at least two repeats, better four",
        NotLearnt::NotConfirmed { .. } => {
            "measure more repeats; what happens once, jumps, or cycles near the spacing of the readings is no smooth function"
        }
        NotLearnt::Unresolved { .. } => {
            "read at closer positions; a step, a cycle near the spacing of the readings, or a function of two things at once cannot be learnt as one smooth curve"
        }
    })
}

fn in_words(model: &AnyModel, learnt: &Learnt) -> String {
    let others: Vec<&HeldOutAlong> = learnt.ways.iter().skip(1).collect();
    let mut text = format!(
        "Learnt as `{}`: a smooth function of {}, {} {} RMS.",
        learnt.effect.name,
        learnt.along,
        number(learnt.rms),
        for_people(model.reading_unit())
    );
    let explained = |way: &HeldOutAlong| {
        if way.explained > 0.0 {
            percent(way.explained)
        } else {
            "nothing".to_owned()
        }
    };
    if let Some(own) = learnt.ways.first() {
        let _ = write!(
            text,
            " It predicts {} of the gap (squared) in repeats that were held out.",
            explained(own)
        );
    }
    for way in others {
        let worse = if way.worse > 1.0 {
            format!("worse by {} standard deviations", plain(way.worse, 2))
        } else {
            "as good as can be told".to_owned()
        };
        let _ = write!(
            text,
            "\n  of {}{}: {}, {worse}",
            way.along,
            if way.curves > 1 {
                format!(" ({} curves)", way.curves)
            } else {
                String::new()
            },
            explained(way)
        );
    }
    text += "\nIt holds only what the model does not absorb, and these readings are no test of it.";
    text
}

/// How the learnt effects of a file fare on readings that they were not learnt from.
pub(super) fn all_tested(
    model: &AnyModel,
    args: &Args,
    effects: &[Tabulated],
    options: &Options,
) -> (Vec<Tested>, Vec<String>) {
    let (mut all, mut notes) = (Vec::new(), Vec::new());
    for effect in effects {
        let Some(seen) = &effect.seen else { continue };
        let known = |file: &&Path| match digest_of(file) {
            Read256::Digest(own) => seen.sha256.split(' ').any(|before| before == own),
            _ => false,
        };
        let again: Vec<String> = args
            .files()
            .filter(known)
            .map(|file| file.display().to_string())
            .collect();
        if !again.is_empty() {
            let readings = if again.len() == args.files().count() {
                "these very readings".to_owned()
            } else {
                format!("some of these readings ({})", again.join(", "))
            };
            notes.push(format!(
                "`{}` was learnt from {readings}: that it explains them is no evidence.",
                effect.name
            ));
            continue;
        }
        if seen.model != model.name() {
            notes.push(format!(
                "`{}` was learnt with another model ({}).",
                effect.name, seen.model
            ));
        }
        match tested(model, effect, options) {
            Some(tested) => {
                if tested.outside > OUTSIDE {
                    notes.push(format!(
                        "{} of the readings lie outside the range in which `{}` was seen; there it keeps the value of the end.",
                        percent(tested.outside),
                        effect.name
                    ));
                }
                all.push(tested);
            }
            None => notes.push(format!(
                "Nothing of `{}` shows in these readings.",
                effect.name
            )),
        }
    }
    (all, notes)
}

/// Part of the readings outside the range of a learnt effect from which on it is told.
const OUTSIDE: f64 = 0.05;

/// A test in words.
pub(super) fn tested_in_words(tested: &Tested, unit: &str) -> String {
    let mut text = format!(
        "`{}`, learnt from {} on {}, here {} times as great (standard uncertainty {}): taken out as it was learnt, the gap goes from {} to {} {} RMS",
        tested.effect,
        tested.seen.file,
        tested.seen.date,
        number(tested.size),
        number(tested.size_std),
        tested.before.figures(),
        tested.after.figures(),
        for_people(unit),
    );
    if let Some(held) = tested.held_out {
        let _ = write!(
            text,
            "; on held-out repeats from {} to {} (a perfect model: {})",
            number(held.before),
            number(held.after),
            number(held.floor)
        );
    }
    let p = probability(tested.p_value);
    let p = if p.starts_with('<') {
        p
    } else {
        format!("= {p}")
    };
    let _ = write!(
        text,
        ". It explains {} of the gap (squared), smooth curves drawn by chance {} in the mean (p {p}).",
        percent(tested.explained),
        percent(tested.by_chance),
    );
    text
}
