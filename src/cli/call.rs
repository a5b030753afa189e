//! A command called by a program: the arguments of the command line, the answer in place of its
//! printing. The Python package calls by this.

use std::cell::RefCell;

use super::common::{Called, Wanted};
use super::{Answer, Command, Traced, declared, parsed};
use crate::io::Message;
use crate::io::source::{InMemory, begin_record_with};

/// Runs a command: `arguments` are those of the command line without the name of the program, such as
/// `["reversal", "<data>", "--simultaneous"]`. A path that is the name of one of the inputs held in
/// memory stands for these bytes. Nothing is printed, and of `--out` and `--format` nothing is heeded;
/// [`Report`](super::Report) writes the folder.
///
/// # Errors
/// The arguments are not understood, or what the command itself refuses.
///
/// ```
/// use std::sync::Arc;
/// use errsep::cli::call::call;
/// use errsep::io::source::InMemory;
///
/// let profile = InMemory {
///     name: "<data>".to_owned(),
///     bytes: Arc::from(&b"x,deviation\n0,0\n100,2\n200,0\n"[..]),
/// };
/// let called = call(&["straightness", "<data>"], vec![profile])?;
/// let zone = &called.answer.json["reference_lines"][2];
/// assert_eq!(zone["reference"], "minimum_zone");
/// assert_eq!(zone["error"]["value"], 2.0);
/// # Ok::<(), errsep::io::Message>(())
/// ```
pub fn call<S: AsRef<str>>(arguments: &[S], in_memory: Vec<InMemory>) -> Result<Traced, Message> {
    let arguments: Vec<String> = arguments.iter().map(|a| a.as_ref().to_owned()).collect();
    answer(&arguments, in_memory, Wanted::Everything)?.traced(&arguments)
}

/// As [`call`], but only what is wanted is worked out, and where it comes from is not told.
///
/// # Errors
/// Those of [`call`].
pub(super) fn answer(
    arguments: &[String],
    in_memory: Vec<InMemory>,
    wanted: Wanted,
) -> Result<Answer, Message> {
    let words = std::iter::once("errsep").chain(arguments.iter().map(String::as_str));
    let cli = DECLARED
        .with_borrow_mut(|declared| parsed(declared, words))
        .map_err(|error| not_understood(&error))?;
    let Command::Answer(command) = &cli.command else {
        return Err(Message::bad_input("this command answers no question")
            .remedy("call one that does, such as `reversal`"));
    };
    begin_record_with(true, in_memory);
    let _called = Called::begin(wanted);
    command.run()
}

thread_local! {
    /// The command line as it is declared: made once for all calls of a thread.
    static DECLARED: RefCell<clap::Command> = RefCell::new(declared());
}

/// What is wrong with the arguments, and the hint that comes with it.
fn not_understood(error: &clap::Error) -> Message {
    let told = error.render().to_string();
    let told = told.strip_prefix("error: ").unwrap_or(&told);
    let mut parts = told.split("\n\n").map(str::trim);
    let what = parts.next().unwrap_or_default();
    let tip = parts.find_map(|part| part.strip_prefix("tip: "));
    Message::bad_input(what.split_whitespace().collect::<Vec<_>>().join(" "))
        .remedy(tip.unwrap_or("see the command's --help for what it takes"))
}
