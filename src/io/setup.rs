//! Reading a set-up (TOML). Each command defines its own struct; this reads it and says where what
//! is wrong.
//!
//! The struct derives `serde::Deserialize` with `#[serde(deny_unknown_fields)]`; a value that must
//! be checked is a [`toml::Spanned`], so that [`SetupFile::bad`] can point at it.

use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::message::{Message, Place, list, nearest, nearest_first};
use super::source::Source;

/// A longer file is no set-up, bytes.
const LONGEST: u64 = 1 << 24;

/// A list of so many numbers, no fewer and no more.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Vec<f64>")]
pub struct Numbers<const N: usize>(pub [f64; N]);

impl<const N: usize> TryFrom<Vec<f64>> for Numbers<N> {
    type Error = String;

    fn try_from(list: Vec<f64>) -> Result<Self, String> {
        let found = list.len();
        let numbers = list.try_into();
        numbers
            .map(Self)
            .map_err(|_| format!("{N} numbers are wanted, and the list has {found}"))
    }
}

/// A set-up file as read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SetupFile {
    path: PathBuf,
    text: String,
}

impl SetupFile {
    /// Reads the text of a set-up.
    ///
    /// # Errors
    /// The file cannot be read or is no text.
    pub fn read(path: &Path) -> Result<Self, Message> {
        let unreadable = |e: std::io::Error| {
            Message::bad_input(format!("the set-up cannot be read: {e}"))
                .in_file(path)
                .remedy("give a readable TOML file")
        };
        let mut bytes = Vec::new();
        Source::open(path)
            .and_then(|source| source.take(LONGEST + 1).read_to_end(&mut bytes))
            .map_err(unreadable)?;
        if bytes.len() as u64 > LONGEST {
            return Err(Message::bad_input("the set-up is longer than 16 MiB")
                .in_file(path)
                .remedy("give a TOML file of a set-up; readings belong into a table (CSV)"));
        }
        let text = String::from_utf8(bytes).map_err(|e| not_text(path, &e))?;
        Ok(Self {
            path: path.to_owned(),
            text,
        })
    }

    /// The set-up as a struct.
    ///
    /// # Errors
    /// The text is no TOML, a key is unknown (the nearest known one is named), a value has the
    /// wrong type, a needed key is missing.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, Message> {
        toml::from_str(&self.text).map_err(|e| {
            let span = e.span().unwrap_or(0..0);
            let message = e.message();
            match unknown_name(message) {
                Some((kind, key, known)) => {
                    let known = nearest_first(key, known);
                    let table = if kind == "key" {
                        self.table_of::<T>(key)
                    } else {
                        None
                    };
                    let remedy = match (kind, nearest(key, known.iter().copied())) {
                        _ if let Some(table) = table => format!("put it under [{table}]"),
                        ("value", Some(near)) => {
                            format!("did you mean `{near}`? Write {}", list(&known))
                        }
                        ("value", None) => format!("write {}", list(&known)),
                        (_, Some(near)) => {
                            format!("did you mean `{near}`? Known here: {}", known.join(", "))
                        }
                        _ if known.is_empty() => "remove it: nothing is known here".to_owned(),
                        _ => format!("remove it; known here: {}", known.join(", ")),
                    };
                    self.bad(span, format!("unknown {kind} `{key}`"), remedy)
                }
                None => self.bad(span, in_words(message), remedy(message)),
            }
        })
    }

    /// The table at the top of the set-up that takes a key which stands at another place.
    fn table_of<T: DeserializeOwned>(&self, key: &str) -> Option<String> {
        let whole: toml::Table = toml::from_str(&self.text).ok()?;
        let tables = whole.values().filter_map(toml::Value::as_table);
        let value = std::iter::once(&whole)
            .chain(tables)
            .find_map(|table| table.get(key))?;
        // What a set-up may have at its top is told by refusing a name that nothing has.
        let none = toml::from_str::<T>("\"\" = 0").err()?;
        let (_, _, top) = unknown_name(none.message())?;
        let takes = |table: &&str| {
            let within = toml::Table::from_iter([(key.to_owned(), value.clone())]);
            let alone = toml::Table::from_iter([((*table).to_owned(), within.into())]);
            match toml::from_str::<T>(&alone.to_string()) {
                Ok(_) => true,
                Err(why) => why.message().starts_with("missing field"),
            }
        };
        let mut found = top.into_iter().filter(takes);
        found.next().map(str::to_owned)
    }

    /// A message about a value of the set-up.
    pub fn bad(
        &self,
        span: Range<usize>,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Message {
        let start = (0..=span.start.min(self.text.len()))
            .rev()
            .find(|&i| self.text.is_char_boundary(i))
            .unwrap_or(0);
        let line_start = self.text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line = self.text[line_start..].lines().next().unwrap_or("");
        let offset = start - line_start;
        Message::bad_input(what)
            .at(Place {
                file: self.path.clone(),
                line: self.text[..start].matches('\n').count() + 1,
                column: self.text[line_start..start].chars().count() + 1,
                text: line.to_owned(),
                length: span.len().min(line.len().saturating_sub(offset)),
            })
            .remedy(remedy)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// What the programs call a kind of value, for people.
fn expected_in_words(expected: &str) -> &str {
    match expected {
        "f32" | "f64" => "a number",
        "i64" | "u8" | "u32" | "u64" | "usize" => "a whole number",
        "a boolean" => "true or false",
        "a string" => "a text",
        "a sequence" => "a list",
        "a map" => "a table",
        other if other.starts_with("struct ") => "a table",
        other => other,
    }
}

/// A fault in the words of serde and of the TOML reader, without names of types.
fn in_words(message: &str) -> String {
    let line = message.lines().collect::<Vec<_>>().join("; ");
    match line.split_once(", expected ") {
        Some((found, expected)) if found.starts_with("invalid ") => {
            let found = match found.strip_prefix("invalid type: ") {
                Some(found) => found.replace("floating point", "the number"),
                None => found.to_owned(),
            };
            format!("{found} where {} belongs", expected_in_words(expected))
        }
        _ => line,
    }
}

/// What to do about a fault, in the words of serde and of the TOML reader.
fn remedy(message: &str) -> String {
    let quoted = || message.split('`').nth(1).unwrap_or_default();
    if message.starts_with("missing field") {
        return format!("add `{} = …`", quoted());
    }
    if message.starts_with("duplicate") {
        return "keep one of the two".to_owned();
    }
    if let Some((found, expected)) = message.split_once(", expected ")
        && found.starts_with("invalid ")
    {
        let expected = match expected_in_words(expected) {
            "a number" => "a number, such as 1.5",
            "a text" => "a text in double quotes",
            "a list" => "a list, such as [1.0, 2.0]",
            "a table" => "a table, such as { key = 1 }",
            other => other,
        };
        return format!("write {expected} here");
    }
    "write TOML: `key = value` a line, texts in double quotes, `[table]` in brackets".to_owned()
}

/// Where a set-up stops being text.
fn not_text(path: &Path, error: &std::string::FromUtf8Error) -> Message {
    let (bytes, place) = (error.as_bytes(), error.utf8_error().valid_up_to());
    let before = String::from_utf8_lossy(&bytes[..place]);
    let line = before.rsplit('\n').next().unwrap_or_default();
    let number = before.matches('\n').count() + 1;
    let utf16 = bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF");
    let what = match bytes.get(place) {
        _ if utf16 => "the set-up is UTF-16".to_owned(),
        Some(byte) => format!("byte 0x{byte:02X} is not text"),
        None => "the set-up is not text".to_owned(),
    };
    Message::bad_input(what)
        .at(Place {
            file: path.to_owned(),
            line: number,
            column: line.chars().count() + 1,
            text: String::new(),
            length: 0,
        })
        .remedy("save the file as plain text (TOML, UTF-8)")
}

/// What is unknown, its name and the known names, in serde's words for an unknown field or variant:
/// ``unknown field `a`, expected one of `b`, `c` ``.
fn unknown_name(message: &str) -> Option<(&'static str, &str, Vec<&str>)> {
    let (kind, rest) = match message.strip_prefix("unknown field ") {
        Some(rest) => ("key", rest),
        None => ("value", message.strip_prefix("unknown variant ")?),
    };
    let mut quoted = rest.split('`').skip(1).step_by(2);
    Some((kind, quoted.next()?, quoted.collect()))
}
