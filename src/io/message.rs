//! The one error type of the program: what is wrong, where, and what to do about it.

use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};

use miette::{Diagnostic, LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan};
use serde_json::Value;
use thiserror::Error;

use super::printable;

/// How a run ended, as the exit status says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Status {
    /// Done: exit status 0.
    Done,
    /// The data are good but the question could not be answered (not converged, not identifiable):
    /// exit status 1.
    NotSolved,
    /// The input or the command line is wrong: exit status 2.
    BadInput,
}

impl Status {
    /// The exit status of the process.
    pub const fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::NotSolved => 1,
            Self::BadInput => 2,
        }
    }
}

/// What kind of trouble a message tells of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Trouble {
    /// The input or the command line is wrong.
    BadInput,
    /// The data are good but do not determine what was asked for.
    NotDetermined,
    /// The data are good but no minimum was found.
    NotConverged,
}

impl Trouble {
    /// How a run ends that meets it.
    pub const fn status(self) -> Status {
        match self {
            Self::BadInput => Status::BadInput,
            Self::NotDetermined | Self::NotConverged => Status::NotSolved,
        }
    }
}

/// One line of an input file and the part of it that a message is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1; 0 where the message is about the file as a whole.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The text of the line, empty where it is not at hand.
    pub text: String,
    /// Length of the offending part, in bytes of `text`.
    pub length: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.to_string_lossy();
        let file = printable::line(&file);
        if self.line == 0 {
            write!(f, "{file}")
        } else {
            write!(f, "{file}:{}:{}", self.line, self.column.max(1))
        }
    }
}

/// The part of a line that is shown, fit for a terminal.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Shown {
    file: String,
    line: usize,
    column: usize,
    text: String,
    /// Where the offending part begins in `text` and how long it is, bytes.
    marked: (usize, usize),
}

/// Characters of a long line that are shown, and how many of them stand before the offending part.
const SHOWN: usize = 160;
const BEFORE: usize = 60;

/// Characters of what is wrong, and of the remedy: names from a file may be of any length.
const LONGEST: usize = 1000;

impl Shown {
    fn of(place: &Place) -> Self {
        let text: Vec<char> = printable::source_line(&place.text).chars().collect();
        let from = place.column.saturating_sub(1).min(text.len());
        let after = byte_of_column(&place.text, place.column);
        let to = from
            + place.text[after..]
                .char_indices()
                .take_while(|(byte, _)| *byte < place.length)
                .count();
        let (first, last) = if text.len() > SHOWN {
            let first = from.saturating_sub(BEFORE);
            (first, (first + SHOWN).min(text.len()))
        } else {
            (0, text.len())
        };
        let part = |range: std::ops::Range<usize>| -> String { text[range].iter().collect() };
        let before = if first > 0 { "…" } else { "" }.to_owned() + &part(first..from);
        let marked = part(from..to.min(last));
        let behind = part(to.min(last)..last) + if last < text.len() { "…" } else { "" };
        Self {
            file: printable::line(&place.file.to_string_lossy()).into_owned(),
            line: place.line,
            column: place.column,
            marked: (before.len(), marked.len()),
            text: before + &marked + &behind,
        }
    }
}

/// A number that is written with more digits than this has them from its power of ten.
const DIGITS: usize = 40;

/// A word of a message; a number of hundreds of digits as a power of ten.
fn word(word: &str) -> Cow<'_, str> {
    match word.parse::<f64>() {
        Ok(number) if word.len() > DIGITS && number.is_finite() => format!("{number:e}").into(),
        _ => word.into(),
    }
}

/// One line of a message: fit for a terminal, its middle left out where it is very long.
fn told(text: &str) -> String {
    let words: Vec<Cow<'_, str>> = text.split(' ').map(word).collect();
    let text = words.join(" ");
    let text = printable::line(&text);
    let count = text.chars().count();
    if count <= LONGEST {
        return text.into_owned();
    }
    let end = LONGEST / 4;
    let begin = LONGEST - end;
    let characters = || text.chars();
    characters()
        .take(begin)
        .chain(" … ".chars())
        .chain(characters().skip(count - end))
        .collect()
}

/// What went wrong, told to the person who can mend it.
///
/// Written as `file:line:column: what is wrong`, followed by the line itself and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}{what}", .place.as_ref().map(|p| format!("{p}: ")).unwrap_or_default())]
pub struct Message {
    what: String,
    place: Option<Box<Place>>,
    shown: Option<Box<Shown>>,
    remedy: Option<String>,
    trouble: Trouble,
    reached: Option<Box<Value>>,
}

impl Message {
    /// Wrong input or command line (exit status 2).
    pub fn bad_input(what: impl Into<String>) -> Self {
        Self {
            what: told(&what.into()),
            place: None,
            shown: None,
            remedy: None,
            trouble: Trouble::BadInput,
            reached: None,
        }
    }

    /// Good data that do not determine what was asked for (exit status 1).
    pub fn not_determined(what: impl Into<String>) -> Self {
        Self {
            trouble: Trouble::NotDetermined,
            ..Self::bad_input(what)
        }
    }

    /// Good data for which no minimum was found (exit status 1).
    pub fn not_converged(what: impl Into<String>) -> Self {
        Self {
            trouble: Trouble::NotConverged,
            ..Self::bad_input(what)
        }
    }

    /// Adds the file that the message is about.
    #[must_use]
    pub fn in_file(self, file: &Path) -> Self {
        self.at(Place {
            file: file.to_owned(),
            line: 0,
            column: 0,
            text: String::new(),
            length: 0,
        })
    }

    /// Adds the place that the message is about.
    #[must_use]
    pub fn at(mut self, place: Place) -> Self {
        self.shown = (!place.text.is_empty()).then(|| Box::new(Shown::of(&place)));
        self.place = Some(Box::new(place));
        self
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(told(&remedy.into()));
        self
    }

    /// Adds what a fit without a minimum had come to, for programs.
    #[must_use]
    pub fn reaching(mut self, reached: Value) -> Self {
        self.reached = Some(Box::new(reached));
        self
    }

    /// What a fit without a minimum had come to, if that is known.
    pub fn reached(&self) -> Option<&Value> {
        self.reached.as_deref()
    }

    /// Where the trouble is, if it has a place.
    pub fn place(&self) -> Option<&Place> {
        self.place.as_deref()
    }

    /// What is wrong, without its place.
    pub fn what(&self) -> &str {
        &self.what
    }

    /// What to do about it, if that is known.
    pub fn remedy_words(&self) -> Option<&str> {
        self.remedy.as_deref()
    }

    /// What kind of trouble it tells of.
    pub const fn trouble(&self) -> Trouble {
        self.trouble
    }

    /// How the run must end.
    pub const fn status(&self) -> Status {
        self.trouble.status()
    }

    /// The message as the terminal shows it: the place, what is wrong, the line with the offending
    /// part marked, and the remedy.
    pub fn render(&self) -> String {
        let mut out = String::new();
        let handler =
            miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor())
                .with_wrap_lines(false);
        match handler.render_report(&mut out, self) {
            Ok(()) => out,
            Err(fmt::Error) => format!("{self}\n"),
        }
    }
}

impl Diagnostic for Message {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.remedy
            .as_ref()
            .map(|r| Box::new(r) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.shown.as_deref().map(|shown| shown as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let (start, length) = self.shown.as_deref()?.marked;
        let span = LabeledSpan::new(None, start, length);
        Some(Box::new(std::iter::once(span)))
    }
}

fn byte_of_column(text: &str, column: usize) -> usize {
    text.char_indices()
        .nth(column.saturating_sub(1))
        .map_or(text.len(), |(byte, _)| byte)
}

/// A source of one line that knows its own line number.
impl SourceCode for Shown {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        _context_lines_before: usize,
        _context_lines_after: usize,
    ) -> Result<Box<dyn miette::SpanContents<'a> + 'a>, MietteError> {
        if span.offset() + span.len() > self.text.len() {
            return Err(MietteError::OutOfBounds);
        }
        Ok(Box::new(MietteSpanContents::new_named(
            self.file.clone(),
            self.text.as_bytes(),
            (0, self.text.len()).into(),
            self.line.saturating_sub(1),
            self.column.saturating_sub(1),
            1,
        )))
    }
}

/// The known name that is nearest to a misspelt one, if any is near enough to be meant.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    known
        .into_iter()
        .map(|k| (strsim::damerau_levenshtein(&lower, &k.to_lowercase()), k))
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, k)| {
            *distance <= 1.max(k.chars().count().max(lower.chars().count()) / 2)
        })
        .map(|(_, k)| k)
}

/// The known names, the nearest to a misspelt one first; names equally near keep their order.
pub fn nearest_first<'a>(name: &str, mut known: Vec<&'a str>) -> Vec<&'a str> {
    let lower = name.to_lowercase();
    known.sort_by_cached_key(|k| strsim::damerau_levenshtein(&lower, &k.to_lowercase()));
    known
}

/// A list of names for a message: `a, b or c`.
pub fn list(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [head @ .., last] => format!("{} or {last}", head.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str, column: usize, length: usize) -> String {
        Message::bad_input("is wrong")
            .at(Place {
                file: "a.csv".into(),
                line: 7,
                column,
                text: text.to_owned(),
                length,
            })
            .remedy("mend it")
            .render()
    }

    #[test]
    fn a_long_line_is_shown_around_the_place() {
        let text = "é".repeat(100_000) + ",wrong," + &"x".repeat(500_000);
        let told = at(&text, 100_002, 5);
        assert!(told.contains("a.csv:7:100002"), "{told}");
        assert!(told.contains("é,wrong,x"), "{told}");
        assert!(told.chars().count() < 2000, "{}", told.len());
        // The mark stands below the word.
        let lines: Vec<&str> = told.lines().collect();
        let row = lines.iter().position(|l| l.contains("wrong,")).unwrap();
        let column = |line: &str, what: &str| {
            let byte = line.find(what).unwrap();
            line[..byte].chars().count()
        };
        let word = column(lines[row], "wrong");
        assert_eq!(column(lines[row + 1], "─────"), word, "{told}");
        // A part that is longer than what is shown, and one past the end.
        assert!(at(&text, 1, text.len()).chars().count() < 2000);
        assert!(at("short", 70_000, 9).contains("a.csv:7:70000"));
    }

    #[test]
    fn nothing_in_a_message_commands_the_terminal() {
        let hostile = "\u{1b}]0;title\u{7}\u{9b}2J\u{202e}";
        let told = Message::bad_input(format!("unknown column `{hostile}`\nfake: line"))
            .at(Place {
                file: format!("{hostile}.csv").into(),
                line: 1,
                column: 2,
                text: format!("a{hostile}b"),
                length: 3,
            })
            .remedy(hostile)
            .render();
        let hidden =
            |c: char| c != '\n' && (c.is_control() || ('\u{202a}'..='\u{202e}').contains(&c));
        assert!(!told.chars().any(hidden), "{told:?}");
        assert!(!told.contains("\nfake"), "{told}");
    }

    #[test]
    fn a_name_of_any_length_leaves_room_for_the_rest() {
        let what = format!("unknown column `{}` in the table", "n".repeat(690_000));
        let told = Message::bad_input(what).to_string();
        assert!(told.starts_with("unknown column `nnn") && told.ends_with("` in the table"));
        assert!(told.chars().count() < 1100);
    }
}
