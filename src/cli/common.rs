//! What every command has.

use std::cell::Cell;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};

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

thread_local! {
    static SILENT: Cell<bool> = const { Cell::new(false) };
}

/// While it lives, what this thread works out shows no progress.
pub(super) struct Silent(bool);

impl Silent {
    pub(super) fn begin() -> Self {
        Self(SILENT.replace(true))
    }
}

impl Drop for Silent {
    fn drop(&mut self) {
        SILENT.set(self.0);
    }
}

/// Progress on standard error, and only when that is a terminal. `total` where the end is known.
pub fn progress(what: &'static str, total: Option<u64>) -> ProgressBar {
    if SILENT.get() {
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
