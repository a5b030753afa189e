//! What every command has.

use std::cell::Cell;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};

use crate::io::{ColumnMap, CsvTable};
use crate::report::Page;

/// How the answer is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Format {
    /// For people.
    #[default]
    Text,
    /// For programs: one JSON object and nothing else on standard output.
    Json,
}

/// Options of every command.
#[derive(Debug, Clone, Args)]
pub struct CommonArgs {
    /// How to print the answer.
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
    /// Write report.html, result.json and CSV tables into this folder.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Let --out replace files that errsep did not write, or that it has just read.
    #[arg(long, requires = "out")]
    pub force: bool,
    /// Print nothing: the folder and the exit status are the answer. Errors are told all the same.
    #[arg(long, short, requires = "out")]
    pub quiet: bool,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// How the columns of the readings are named, where not as the command has them.
#[derive(Debug, Clone, Default, Args)]
pub struct ColumnArgs {
    /// Names and units of the columns, as role=column:unit,...; units are nm, um, mm, m, inch, uinch, ms,
    /// s, min, h. Columns that are not named are not read.
    #[arg(long, value_name = "ROLE=COLUMN:UNIT,...")]
    columns: Option<ColumnMap>,
}

impl ColumnArgs {
    /// These names and units.
    #[must_use]
    pub fn of(map: ColumnMap) -> Self {
        Self { columns: Some(map) }
    }

    /// The names and units; none where the columns are named as the command has them.
    #[must_use]
    pub fn map(&self) -> ColumnMap {
        self.columns.clone().unwrap_or_default()
    }

    /// Whether any are given.
    #[must_use]
    pub fn are_given(&self) -> bool {
        self.columns.is_some()
    }
}

/// What a program that calls a command wants of its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// Text, JSON, page and tables.
    Everything,
    /// The JSON; text, page and tables may be empty.
    Json,
}

thread_local! {
    static CALLED: Cell<Option<Wanted>> = const { Cell::new(None) };
}

/// While it lives, what this thread works out is for a program: no progress is shown.
pub(super) struct Called(Option<Wanted>);

impl Called {
    pub(super) fn begin(wanted: Wanted) -> Self {
        Self(CALLED.replace(Some(wanted)))
    }
}

impl Drop for Called {
    fn drop(&mut self) {
        CALLED.set(self.0);
    }
}

impl CommonArgs {
    /// Whether the text is wanted.
    fn wants_text(&self) -> bool {
        match CALLED.get() {
            Some(wanted) => wanted == Wanted::Everything,
            None => self.format == Format::Text && !self.quiet,
        }
    }

    /// Whether page and tables are wanted.
    pub(super) fn wants_folder(&self) -> bool {
        match CALLED.get() {
            Some(wanted) => wanted == Wanted::Everything,
            None => self.out.is_some(),
        }
    }

    /// Whether the JSON is wanted.
    pub(super) fn wants_json(&self) -> bool {
        CALLED.get().is_some() || self.out.is_some() || self.format == Format::Json
    }

    /// The text, where it is wanted.
    pub(super) fn text(&self, make: impl FnOnce() -> String) -> String {
        if self.wants_text() {
            make()
        } else {
            String::new()
        }
    }

    /// The page, where it is wanted.
    pub(super) fn page(&self, make: impl FnOnce() -> Page) -> Page {
        if self.wants_folder() {
            make()
        } else {
            Page::new("", String::new())
        }
    }

    /// The tables, where they are wanted.
    pub(super) fn tables(&self, make: impl FnOnce() -> Vec<CsvTable>) -> Vec<CsvTable> {
        if self.wants_folder() {
            make()
        } else {
            Vec::new()
        }
    }
}

/// Progress on standard error, and only when that is a terminal. `total` where the end is known.
pub fn progress(what: &'static str, total: Option<u64>) -> ProgressBar {
    if CALLED.get().is_some() {
        return ProgressBar::hidden();
    }
    let bar = match total {
        Some(n) => ProgressBar::new(n),
        None => ProgressBar::new_spinner(),
    };
    let template = match total {
        Some(_) => "{msg} [{bar:30}] {pos}/{len} {eta}",
        None => "{msg} {spinner} {elapsed}",
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.set_message(what);
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
