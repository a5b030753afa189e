//! Reading a set-up (TOML). Each command defines its own struct; this reads it and says where what
//! is wrong.
//!
//! The struct derives `serde::Deserialize` with `#[serde(deny_unknown_fields)]`; a value that must
//! be checked is a [`toml::Spanned`], so that [`SetupFile::bad`] can point at it.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::message::{Message, Place, list, nearest, nearest_first};

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
        let text = std::fs::read_to_string(path).map_err(|e| {
            Message::bad_input(format!("the set-up cannot be read: {e}"))
                .in_file(path)
                .remedy("give a readable TOML file")
        })?;
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
                    let remedy = match (kind, nearest(key, known.iter().copied())) {
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
                None => self.bad(
                    span,
                    message.lines().collect::<Vec<_>>().join("; "),
                    "see the command's --help and the documentation of the set-up",
                ),
            }
        })
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
