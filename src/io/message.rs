//! The one error type of the program: what is wrong, where, and what to do about it.

use std::fmt;
use std::path::{Path, PathBuf};

use miette::{Diagnostic, LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan};
use thiserror::Error;

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
        if self.line == 0 {
            write!(f, "{}", self.file.display())
        } else {
            write!(
                f,
                "{}:{}:{}",
                self.file.display(),
                self.line,
                self.column.max(1)
            )
        }
    }
}

/// What went wrong, told to the person who can mend it.
///
/// Written as `file:line:column: what is wrong`, followed by the line itself and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}{what}", .place.as_ref().map(|p| format!("{p}: ")).unwrap_or_default())]
pub struct Message {
    what: String,
    place: Option<Box<Place>>,
    remedy: Option<String>,
    status: Status,
}

impl Message {
    /// Wrong input or command line (exit status 2).
    pub fn bad_input(what: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            place: None,
            remedy: None,
            status: Status::BadInput,
        }
    }

    /// Good input, no answer (exit status 1).
    pub fn not_solved(what: impl Into<String>) -> Self {
        Self {
            status: Status::NotSolved,
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
        self.place = Some(Box::new(place));
        self
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }

    /// Where the trouble is, if it has a place.
    pub fn place(&self) -> Option<&Place> {
        self.place.as_deref()
    }

    /// How the run must end.
    pub const fn status(&self) -> Status {
        self.status
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

    fn has_line(&self) -> bool {
        self.place().is_some_and(|p| !p.text.is_empty())
    }
}

impl Diagnostic for Message {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.remedy
            .as_ref()
            .map(|r| Box::new(r) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.has_line()
            .then(|| self.place().map(|p| p as &dyn SourceCode))
            .flatten()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        if !self.has_line() {
            return None;
        }
        let place = self.place()?;
        let start = byte_of_column(&place.text, place.column);
        let span = LabeledSpan::new(None, start, place.length.min(place.text.len() - start));
        Some(Box::new(std::iter::once(span)))
    }
}

fn byte_of_column(text: &str, column: usize) -> usize {
    text.char_indices()
        .nth(column.saturating_sub(1))
        .map_or(text.len(), |(byte, _)| byte)
}

/// A place is a source of one line that knows its own line number.
impl SourceCode for Place {
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
            self.file.display().to_string(),
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
