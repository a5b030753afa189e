//! What a table costs: how far its straight lines miss the form that was found, and how well its values are known.

use serde_json::{Value, json};

use crate::io::units::symbol;
use crate::report::number;

/// How far straight lines between the points of a table miss what was found, at most.
#[derive(Debug, Clone, PartialEq)]
pub struct Missed {
    /// Of which error.
    pub of: String,
    /// Magnitude, in `unit`.
    pub value: f64,
    /// `um`, `arcsec` or `rad`.
    pub unit: &'static str,
    /// Where, mm or degrees.
    pub at: f64,
}

/// Standard uncertainties of the values in a table, as far as the result tells them.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Of which error.
    pub of: String,
    /// `um`, `arcsec` or `rad`.
    pub unit: &'static str,
    /// Positions of the table, mm or degrees.
    pub at: Vec<f64>,
    /// Standard uncertainty of the value there, in `unit`.
    pub std: Vec<f64>,
    /// Degrees of freedom of these, where they come from the scatter of a few readings.
    pub degrees_of_freedom: Option<f64>,
}

impl Missed {
    /// The greatest of magnitudes at places, none of no place.
    pub fn greatest(
        of: &str,
        unit: &'static str,
        all: impl Iterator<Item = (f64, f64)>,
    ) -> Option<Self> {
        let (at, value) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(Self {
            of: of.to_owned(),
            value,
            unit,
            at,
        })
    }

    pub(super) fn as_json(&self) -> Value {
        json!({"of": self.of, "value": self.value, "unit": self.unit, "at": self.at})
    }
}

impl Known {
    pub(super) fn as_json(&self) -> Value {
        json!({
            "of": self.of, "unit": self.unit, "at": self.at, "std": self.std,
            "degrees_of_freedom": self.degrees_of_freedom,
        })
    }

    fn greatest(&self) -> Option<(f64, f64)> {
        let all = self.at.iter().copied().zip(self.std.iter().copied());
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The worst of each unit, a sentence a unit; `place` is the unit of positions.
pub fn in_words(missed: &[Missed], known: &[Known], place: &str) -> Vec<String> {
    let place = symbol(place);
    let mut told = Vec::new();
    let units = ["um", "arcsec", "rad"];
    for unit in units {
        let own = missed.iter().filter(|m| m.unit == unit);
        if let Some(worst) = own.max_by(|a, b| a.value.total_cmp(&b.value)) {
            told.push(format!(
                "straight lines between the points miss what was found by {} {} at most ({} at {} {place})",
                number::plain(worst.value, 2),
                symbol(unit),
                worst.of,
                short(worst.at)
            ));
        }
    }
    for unit in units {
        let own = known.iter().filter(|k| k.unit == unit);
        let worst = own.filter_map(|k| Some((k, k.greatest()?)));
        if let Some((known, (at, std))) = worst.max_by(|a, b| a.1.1.total_cmp(&b.1.1)) {
            told.push(format!(
                "standard uncertainty of a value up to {} {} ({} at {} {place})",
                number::uncertainty(std),
                symbol(unit),
                known.of,
                short(at)
            ));
        }
    }
    told
}

/// The same as comments of a file, a line each after `mark`, in the letters that every controller reads.
pub fn comments(mark: &str, missed: &[Missed], known: &[Known]) -> String {
    in_words(missed, known, "mm")
        .iter()
        .map(|sentence| format!("{mark} {}\n", ascii(sentence)))
        .collect()
}

fn ascii(text: &str) -> String {
    const SUPERSCRIPTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    let text = text.replace(" × 10", "e").replace('µ', "u");
    let digit = |c: char| SUPERSCRIPTS.chars().position(|s| s == c);
    text.chars()
        .map(|c| match (c, digit(c)) {
            ('−' | '⁻', _) => '-',
            (_, Some(digit)) => char::from(b'0' + digit as u8),
            _ => c,
        })
        .collect()
}

/// A position as short as it is, to 0.1 µm.
fn short(position: f64) -> String {
    let text = number::fixed(position, 4);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
