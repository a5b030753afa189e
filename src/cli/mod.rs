//! The command line: one file a command, each producing an [`Answer`] that is delivered here.

pub mod anova;
mod answer;
pub mod batch;
pub mod call;
pub mod check;
pub mod circle;
mod common;
pub mod completions;
pub mod diagnose;
mod disagreement;
pub mod export;
pub mod four_sensor;
pub mod fourier;
pub mod machine;
pub mod man;
pub mod plan;
pub mod positioning;
mod quantity;
pub mod reversal;
pub mod simulate;
pub mod step_diagonal;
pub mod straightness;
pub mod traces;

use std::any::TypeId;
use std::borrow::Cow;
use std::ffi::OsString;
use std::io::Write;
use std::num::{IntErrorKind, ParseIntError};
use std::str::FromStr;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub use answer::{Answer, Report, Traced, result_json};
pub use common::{ColumnArgs, CommonArgs, Format, progress};

use crate::io::source::begin_record;
use crate::io::{Message, OutFolder, Status, printable};

/// Separates a machine tool's geometric errors from those of the artefact, the sensors and the
/// set-up, with uncertainty.
#[derive(Debug, Parser)]
#[command(name = "errsep", version, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// The arguments as they were given, for the record of the answer.
    #[arg(skip)]
    arguments: Vec<String>,
}

#[derive(Debug, Subcommand)]
enum Command {
    #[command(flatten)]
    Answer(Answering),
    Batch(batch::Args),
    Completions(completions::Args),
    Export(export::Args),
    Man(man::Args),
}

// The commands that answer a question. (A doc comment would be taken for the program's own.)
#[derive(Debug, Subcommand)]
enum Answering {
    Anova(anova::Args),
    Check(check::Args),
    Circle(circle::Args),
    Diagnose(Box<diagnose::Args>),
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

/// The program: `arguments` begin with its name. Help and version are printed. Returns the exit status:
/// 0 done, 1 could not be solved, 2 bad input or a command line that is not understood.
pub fn run(arguments: Vec<OsString>) -> u8 {
    let told = arguments.iter().skip(1);
    let told = told.map(|a| a.to_string_lossy().into_owned()).collect();
    match parsed(&mut declared(), arguments) {
        Ok(cli) => Cli {
            arguments: told,
            ..cli
        }
        .execute(),
        Err(error) => not_run(&error),
    }
}

/// The command line as it is declared. A number may be negative everywhere: the command says what it may be.
fn declared() -> clap::Command {
    fn signed(command: clap::Command) -> clap::Command {
        command.mut_args(number).mut_subcommands(signed)
    }
    signed(Cli::command())
}

/// An option, read as what it is where that is a number.
fn number(arg: clap::Arg) -> clap::Arg {
    if !arg.get_action().takes_values() {
        return arg;
    }
    let kind = arg.get_value_parser().type_id();
    let arg = if kind == TypeId::of::<u32>() {
        arg.value_parser(whole::<u32>)
    } else if kind == TypeId::of::<u64>() {
        arg.value_parser(whole::<u64>)
    } else if kind == TypeId::of::<usize>() {
        arg.value_parser(whole::<usize>)
    } else if kind == TypeId::of::<f64>() {
        arg
    } else {
        return arg;
    };
    arg.allow_negative_numbers(true)
}

/// A number that counts something.
fn whole<N: FromStr<Err = ParseIntError>>(text: &str) -> Result<N, &'static str> {
    text.parse()
        .map_err(|error: ParseIntError| match error.kind() {
            IntErrorKind::PosOverflow => "it is too great",
            _ => "give a whole number, 0 or greater",
        })
}

/// What the words of a command line ask for.
fn parsed<W: Into<OsString> + Clone>(
    declared: &mut clap::Command,
    words: impl IntoIterator<Item = W>,
) -> Result<Cli, clap::Error> {
    let mut matches = declared.try_get_matches_from_mut(words)?;
    Cli::from_arg_matches_mut(&mut matches).map_err(|error| error.format(declared))
}

/// Prints what clap has to say instead of running a command.
fn not_run(error: &clap::Error) -> u8 {
    let plain = error.render().to_string();
    match printable::lines(&plain) {
        Cow::Borrowed(_) => {
            // Nothing is left to tell a stream that is closed.
            let _ = error.print();
            u8::try_from(error.exit_code()).unwrap_or(Status::BadInput.code())
        }
        // It repeats what a terminal would obey.
        Cow::Owned(safe) => {
            let _ = write!(std::io::stderr(), "{safe}");
            Status::BadInput.code()
        }
    }
}

impl Cli {
    /// Runs the command and prints or writes its answer.
    fn execute(&self) -> u8 {
        let ended = match &self.command {
            Command::Answer(command) => self.answered(command.common(), || command.run()),
            Command::Batch(args) => batch::run(args),
            Command::Completions(args) => completions::run(args),
            Command::Export(args) => self.answered(&args.common(), || export::run(args)),
            Command::Man(args) => man::run(args),
        };
        let status = ended.unwrap_or_else(|message| {
            // Nothing is left to tell a standard error that is closed.
            let _ = write!(std::io::stderr(), "{}", message.render());
            message.status()
        });
        status.code()
    }

    /// Makes sure that the answer can be written, works it out, and delivers it.
    fn answered(
        &self,
        common: &CommonArgs,
        work: impl FnOnce() -> Result<Answer, Message>,
    ) -> Result<Status, Message> {
        let out = common.out.as_deref();
        let folder = out
            .map(|place| OutFolder::reserve(place, common.force))
            .transpose()?;
        begin_record(folder.is_some() || common.format == Format::Json);
        work()?.deliver(&self.arguments, common, folder)
    }
}

impl Answering {
    fn common(&self) -> &CommonArgs {
        match self {
            Self::Anova(args) => &args.common,
            Self::Check(args) => &args.common,
            Self::Circle(args) => &args.common,
            Self::Diagnose(args) => &args.common,
            Self::FourSensor(args) => &args.common,
            Self::Fourier(args) => &args.common,
            Self::Machine(args) => args.common(),
            Self::Plan(args) => &args.common,
            Self::Positioning(args) => &args.common,
            Self::Reversal(args) => &args.common,
            Self::Simulate(args) => args.common(),
            Self::StepDiagonal(args) => &args.common,
            Self::Straightness(args) => &args.common,
            Self::Traces(args) => &args.common,
        }
    }

    fn run(&self) -> Result<Answer, Message> {
        match self {
            Self::Anova(args) => anova::run(args),
            Self::Check(args) => check::run(args),
            Self::Circle(args) => circle::run(args),
            Self::Diagnose(args) => diagnose::run(args),
            Self::FourSensor(args) => four_sensor::run(args),
            Self::Fourier(args) => fourier::run(args),
            Self::Machine(args) => machine::run(args),
            Self::Plan(args) => plan::run(args),
            Self::Positioning(args) => positioning::run(args),
            Self::Reversal(args) => reversal::run(args),
            Self::Simulate(args) => simulate::run(args),
            Self::StepDiagonal(args) => step_diagonal::run(args),
            Self::Straightness(args) => straightness::run(args),
            Self::Traces(args) => traces::run(args),
        }
    }
}
