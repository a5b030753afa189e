//! What a command answers, and how the answer reaches the person or program that asked.

use std::io::Write;
use std::path::PathBuf;

use serde_json::Value;

use super::common::{CommonArgs, Format};
use crate::io::provenance::Provenance;
use crate::io::{CsvTable, Message, OutFolder, Status, printable};
use crate::report::{self, Page};

/// Name of the set-up in the folder of an answer.
pub(super) const SETUP: &str = "setup.toml";

/// The answer of a command, in every form in which it may be asked for.
#[derive(Debug, Clone)]
pub struct Answer {
    /// For people, on the terminal.
    pub text: String,
    /// For programs: an object whose `schema` is `errsep.<command>/<version>`.
    pub json: Value,
    /// The report.
    pub page: Page,
    /// The profiles and other tables.
    pub tables: Vec<CsvTable>,
    /// The set-up that goes with the tables, as TOML: `setup.toml` of the folder.
    pub setup: Option<String>,
    /// The files that were read.
    pub inputs: Vec<PathBuf>,
    /// The seed, where anything was random.
    pub seed: Option<u64>,
    /// [`Status::Done`], or [`Status::NotSolved`] where the answer says why there is none.
    pub status: Status,
}

impl Answer {
    /// Writes the folder, if one was asked for, then prints, unless told to be quiet.
    pub(super) fn deliver(
        self,
        common: &CommonArgs,
        folder: Option<OutFolder>,
    ) -> Result<Status, Message> {
        let format = common.format;
        let Self {
            text,
            mut json,
            page,
            tables,
            setup,
            inputs,
            seed,
            status,
        } = self;
        if folder.is_none() && format == Format::Text {
            print(&printable::lines(&text))?;
            return Ok(status);
        }
        let mut provenance = Provenance::of(inputs.iter().map(PathBuf::as_path), seed)?;
        let (mut folder, mut written) = (folder, String::new());
        if let Some(folder) = &mut folder {
            let page = page.provenance(report::Provenance {
                version: provenance.version.to_owned(),
                command: format!("{} {}", provenance.program, provenance.command.join(" ")),
                inputs: provenance
                    .inputs
                    .iter()
                    .map(|i| (i.file.clone(), i.sha256.clone()))
                    .collect(),
                seed,
                date: None,
            });
            folder.write("report.html", page.render().as_bytes())?;
            for table in &tables {
                folder.write_table(table)?;
            }
            if let Some(setup) = &setup {
                folder.write(SETUP, setup.as_bytes())?;
            }
            provenance.files = folder.written();
            let names = tables.iter().map(|t| t.file_name.as_str());
            let names = names.chain(setup.iter().map(|_| SETUP));
            written = format!(
                "\nWritten to {}: report.html, result.json{}\n",
                folder.place().display(),
                names.map(|name| format!(", {name}")).collect::<String>()
            );
        }
        if let Value::Object(object) = &mut json {
            object.insert("provenance".to_owned(), as_json(&provenance)?);
        }
        let pretty = serde_json::to_string_pretty(&json).map_err(unwritable)?;
        let mut result = printable::json(&pretty).into_owned();
        result.push('\n');
        if let Some(mut folder) = folder {
            folder.write("result.json", result.as_bytes())?;
            folder.finish(&inputs)?;
        }
        match format {
            _ if common.quiet => {}
            Format::Text => print(&printable::lines(&(text + &written)))?,
            Format::Json => print(&result)?,
        }
        Ok(status)
    }
}

fn as_json(provenance: &Provenance) -> Result<Value, Message> {
    serde_json::to_value(provenance).map_err(unwritable)
}

fn unwritable(error: serde_json::Error) -> Message {
    Message::bad_input(format!("the result cannot be written as JSON: {error}"))
}

/// Prints to standard output. A reader that has heard enough and closed it is no error.
pub(super) fn print(text: &str) -> Result<(), Message> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Message::bad_input(format!(
            "the answer cannot be printed: {e}"
        ))),
        _ => Ok(()),
    }
}
