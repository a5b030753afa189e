//! An effect of curves or of a formula as the file that `--effects` reads.

use std::fmt::Write;

use errsep_models::model::FittedModel;

use crate::catalogue::curve::Along;
use crate::catalogue::tabulated::{Seen, Tabulated};

/// Digits of a change, of a place and of an open change: the band is known to no more.
const DIGITS: [usize; 3] = [6, 10, 3];

/// The text of a file with one effect of curves or of a formula. `heading`: lines for people, without their `#`.
pub fn written<M: FittedModel>(effect: &Tabulated, model: &M, heading: &[String]) -> String {
    let mut text: String = heading.iter().map(|line| format!("# {line}\n")).collect();
    let _ = write!(text, "\n[[effect]]\nname = {}\n", quoted(&effect.name));
    let along = effect.along.unwrap_or(Along::Position);
    if let Some(formula) = &effect.formula {
        let _ = writeln!(
            text,
            "formula = {}   # {}",
            quoted(formula.text()),
            model.reading_unit()
        );
    } else {
        let _ = writeln!(
            text,
            "along = {}   # {}",
            quoted(along.name()),
            along.unit(model)
        );
    }
    if !effect.channels.is_empty() {
        let weights = effect.channels.iter();
        let weights: Vec<String> = weights
            .map(|(name, w)| format!("{} = {w:?}", quoted(name)))
            .collect();
        let _ = writeln!(text, "channels = {{ {} }}", weights.join(", "));
    }
    if let Some(seen) = &effect.seen {
        text += &seen_in(seen);
    }
    for curve in &effect.curve {
        text += "\n[[effect.curve]]\n";
        if let Some(channel) = &curve.channel {
            let _ = writeln!(text, "channel = {}", quoted(channel));
        }
        if let Some(way) = curve.direction {
            let _ = writeln!(text, "direction = {}", quoted(way.name()));
        }
        let _ = writeln!(
            text,
            "points = [   # {}, change of the reading and its standard uncertainty, {}",
            along.name(),
            model.reading_unit()
        );
        for [at, change, std] in &curve.points {
            let _ = writeln!(
                text,
                "    [{}, {}, {}],",
                rounded(*at, DIGITS[1]),
                rounded(*change, DIGITS[0]),
                rounded(*std, DIGITS[2])
            );
        }
        text += "]\n";
        if !curve.open.is_empty() {
            text +=
                "open = [   # independent changes of one standard deviation each, at the points\n";
            for change in &curve.open {
                let values: Vec<String> = change.iter().map(|v| rounded(*v, DIGITS[2])).collect();
                let _ = writeln!(text, "    [{}],", values.join(", "));
            }
            text += "]\n";
        }
    }
    text
}

fn seen_in(seen: &Seen) -> String {
    let channels: Vec<String> = seen.channels.iter().map(|c| quoted(c)).collect();
    let repeats: Vec<String> = seen.repeats.iter().map(u32::to_string).collect();
    format!(
        "\n[effect.seen]\nmodel = {}\nfile = {}\nsha256 = {}\nchannels = [{}]\nrepeats = [{}]\ndate = {}\n",
        quoted(&seen.model),
        quoted(&seen.file),
        quoted(&seen.sha256),
        channels.join(", "),
        repeats.join(", "),
        quoted(&seen.date)
    )
}

/// A text as TOML has it.
pub fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A number to some digits, with a point or an exponent.
pub fn rounded(value: f64, digits: usize) -> String {
    let short = format!("{value:.*e}", digits - 1);
    short
        .parse::<f64>()
        .map_or(short, |value| format!("{value:?}"))
}
