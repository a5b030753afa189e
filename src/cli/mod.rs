//! The command line: one file a command, each producing an [`Answer`] that is delivered here.

pub mod anova;
mod answer;
pub mod circle;
mod common;
pub mod diagnose;
pub mod export;
pub mod four_sensor;
pub mod fourier;
pub mod machine;
pub mod plan;
pub mod positioning;
mod quantity;
pub mod reversal;
pub mod simulate;
pub mod step_diagonal;
pub mod straightness;
pub mod traces;

use std::borrow::Cow;
use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use answer::Answer;
pub use common::{CommonArgs, Format, progress};

use crate::io::source::begin_record;
use crate::io::{Message, OutFolder, Status, printable};

/// Separates a machine tool's geometric errors from those of the artefact, the sensors and the
/// set-up, with uncertainty.
#[derive(Debug, Parser)]
#[command(name = "errsep", version, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Anova(anova::Args),
    Circle(circle::Args),
    Diagnose(diagnose::Args),
    Export(export::Args),
    FourSensor(four_sensor::Args),
    Fourier(fourier::Args),
    Machine(machine::Args),
    Plan(plan::Args),
    Positioning(positioning::Args),
    Reversal(reversal::Args),
    Simulate(simulate::Args),
    StepDiagonal(step_diagonal::Args),
    Straightness(straightness::Args),
    Traces(traces::Args),
}

impl Cli {
    /// The command line of this process. Help and version are printed and end it with status 0, a
    /// command line that is not understood with 2.
    ///
    /// # Errors
    /// How the process must end.
    pub fn from_arguments() -> Result<Self, ExitCode> {
        Self::try_parse().map_err(|error| {
            let plain = error.render().to_string();
            match printable::lines(&plain) {
                Cow::Borrowed(_) => error.exit(),
                // It repeats what a terminal would obey.
                Cow::Owned(safe) => {
                    let _ = write!(std::io::stderr(), "{safe}");
                    ExitCode::from(Status::BadInput.code())
                }
            }
        })
    }

    /// Runs the command, prints or writes its answer, and says how it ended: 0 done, 1 could not
    /// be solved, 2 bad input.
    pub fn execute(&self) -> ExitCode {
        let outcome = match &self.command {
            Command::Anova(args) => answered(&args.common, || anova::run(args)),
            Command::Circle(args) => answered(&args.common, || circle::run(args)),
            Command::Diagnose(args) => answered(&args.common, || diagnose::run(args)),
            Command::Export(args) => answered(&args.common(), || export::run(args)),
            Command::FourSensor(args) => answered(&args.common, || four_sensor::run(args)),
            Command::Fourier(args) => answered(&args.common, || fourier::run(args)),
            Command::Machine(args) => answered(args.common(), || machine::run(args)),
            Command::Plan(args) => answered(&args.common, || plan::run(args)),
            Command::Positioning(args) => answered(&args.common, || positioning::run(args)),
            Command::Reversal(args) => answered(&args.common, || reversal::run(args)),
            Command::Simulate(args) => answered(args.common(), || simulate::run(args)),
            Command::StepDiagonal(args) => answered(&args.common, || step_diagonal::run(args)),
            Command::Straightness(args) => answered(&args.common, || straightness::run(args)),
            Command::Traces(args) => answered(&args.common, || traces::run(args)),
        };
        let status = outcome.unwrap_or_else(|message| {
            // Nothing is left to tell a standard error that is closed.
            let _ = write!(std::io::stderr(), "{}", message.render());
            message.status()
        });
        ExitCode::from(status.code())
    }
}

/// Makes sure that the answer can be written, works it out, and delivers it.
fn answered(
    common: &CommonArgs,
    work: impl FnOnce() -> Result<Answer, Message>,
) -> Result<Status, Message> {
    let out = common.out.as_deref();
    let folder = out
        .map(|place| OutFolder::reserve(place, common.force))
        .transpose()?;
    begin_record(folder.is_some() || common.format == Format::Json);
    work()?.deliver(common.format, folder)
}
