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

/// An answer with the record of where it comes from, which its page shows too.
#[derive(Debug, Clone)]
pub struct Traced {
    /// The answer.
    pub answer: Answer,
    /// Program, command and inputs.
    pub provenance: Provenance,
}

impl Answer {
    /// Adds where the answer comes from: `command` are the arguments.
    pub(super) fn traced(mut self, command: &[String]) -> Result<Traced, Message> {
        let inputs = self.inputs.iter().map(PathBuf::as_path);
        let provenance = Provenance::of(command, inputs, self.seed)?;
        self.page = self.page.provenance(report::Provenance {
            version: provenance.version.clone(),
            command: format!("{} {}", provenance.program, provenance.command.join(" ")),
            inputs: provenance
                .inputs
                .iter()
                .map(|i| (i.file.clone(), i.sha256.clone()))
                .collect(),
            seed: self.seed,
            date: None,
        });
        Ok(Traced {
            answer: self,
            provenance,
        })
    }

    /// Writes the folder, if one was asked for, then prints, unless told to be quiet.
    pub(super) fn deliver(
        self,
        command: &[String],
        common: &CommonArgs,
        folder: Option<OutFolder>,
    ) -> Result<Status, Message> {
        let format = common.format;
        if folder.is_none() && format == Format::Text {
            print(&printable::lines(&self.text))?;
            return Ok(self.status);
        }
        let Traced { answer, provenance } = self.traced(command)?;
        let (result, written) = match folder {
            Some(folder) => {
                let place = folder.place().to_owned();
                let report = Report {
                    html: &answer.page.render(),
                    json: &answer.json,
                    tables: &answer.tables,
                    setup: answer.setup.as_deref(),
                    inputs: &answer.inputs,
                    provenance,
                };
                let names = report.names();
                let written = format!("\nWritten to {}: {names}\n", place.display());
                (report.write(folder)?, written)
            }
            None => (result_json(&answer.json, &provenance)?, String::new()),
        };
        match format {
            _ if common.quiet => {}
            Format::Text => print(&printable::lines(&(answer.text + &written)))?,
            Format::Json => print(&result)?,
        }
        Ok(answer.status)
    }
}

/// What the folder of a report holds.
#[derive(Debug)]
pub struct Report<'a> {
    /// `report.html`.
    pub html: &'a str,
    /// `result.json` without its provenance.
    pub json: &'a Value,
    /// The tables.
    pub tables: &'a [CsvTable],
    /// `setup.toml`.
    pub setup: Option<&'a str>,
    /// The files that were read: none of them is replaced.
    pub inputs: &'a [PathBuf],
    /// Where the answer comes from; the written files are added.
    pub provenance: Provenance,
}

impl Report<'_> {
    /// The names of the files.
    fn names(&self) -> String {
        let tables = self.tables.iter().map(|t| t.file_name.as_str());
        let names = tables.chain(self.setup.iter().map(|_| SETUP));
        let more = names.map(|name| format!(", {name}")).collect::<String>();
        format!("report.html, result.json{more}")
    }

    /// Writes the folder, whole or not at all; returns the text of `result.json`.
    ///
    /// # Errors
    /// Those of [`OutFolder`].
    pub fn write(mut self, mut folder: OutFolder) -> Result<String, Message> {
        folder.write("report.html", self.html.as_bytes())?;
        for table in self.tables {
            folder.write_table(table)?;
        }
        if let Some(setup) = self.setup {
            folder.write(SETUP, setup.as_bytes())?;
        }
        self.provenance.files = folder.written();
        let result = result_json(self.json, &self.provenance)?;
        folder.write("result.json", result.as_bytes())?;
        folder.finish(self.inputs)?;
        Ok(result)
    }
}

/// An answer's JSON with its provenance, as it is printed.
///
/// # Errors
/// It cannot be written as JSON.
pub fn result_json(answer: &Value, provenance: &Provenance) -> Result<String, Message> {
    let mut json = answer.clone();
    if let Value::Object(object) = &mut json {
        object.insert("provenance".to_owned(), as_json(provenance)?);
    }
    let pretty = serde_json::to_string_pretty(&json).map_err(unwritable)?;
    let mut result = printable::json(&pretty).into_owned();
    result.push('\n');
    Ok(result)
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
