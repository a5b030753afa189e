//! A result that was read, and which formats take it.

use serde_json::Value;

use super::source::{all_formats, for_controller};
use super::{Content, FORMATS, Format, Kind, MachineErrors, certificate};
use crate::io::Message;
use crate::io::message::list;

/// A result that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// Its schema; `a machine` for a TOML file.
    pub schema: String,
    /// What formats can take from it.
    contents: Vec<Content>,
    /// Whether controllers take its schema.
    controllers: bool,
    /// Whether certificates take its schema.
    certificates: bool,
}

impl Loaded {
    /// The errors of a machine.
    pub(super) fn machine(errors: MachineErrors) -> Self {
        Self {
            schema: "a machine".to_owned(),
            contents: vec![Content::Machine(errors)],
            controllers: true,
            certificates: false,
        }
    }

    /// What a result holds.
    ///
    /// # Errors
    /// It has no schema, one that no format takes, or lacks what its schema says.
    pub(super) fn of(result: &Value) -> Result<Self, Message> {
        let schema = result["schema"].as_str().unwrap_or_default();
        if schema.is_empty() {
            return Err(
                Message::bad_input("this JSON is no result of errsep: it has no `schema`")
                    .remedy("give result.json of a report, or what --format json printed"),
            );
        }
        let controller = for_controller(schema, result);
        let (controllers, certificates) = (controller.is_some(), certificate::known(schema));
        if !controllers && !certificates {
            return Err(
                Message::bad_input(format!("no format takes a result {schema}"))
                    .remedy(format!("{}: give one of these", all_formats())),
            );
        }
        let numbers = certificate::numbers(schema, result).map(Content::Numbers);
        let contents: Vec<Content> = controller.flatten().into_iter().chain(numbers).collect();
        if contents.is_empty() {
            return Err(lacks(
                schema,
                "what a controller needs and what a certificate states",
            ));
        }
        Ok(Self {
            schema: schema.to_owned(),
            contents,
            controllers,
            certificates,
        })
    }

    /// What a format takes.
    ///
    /// # Errors
    /// The result holds nothing for this format; the message names the formats that take it.
    pub fn content(&self, format: &Format) -> Result<&Content, Message> {
        let of = |format: &Format| self.contents.iter().find(|c| format.takes.is_in(c));
        if let Some(content) = of(format) {
            return Ok(content);
        }
        let held = |content: &Content| matches!(content, Content::Numbers(_));
        let certificate = format.takes == Kind::Numbers;
        if certificate && self.certificates {
            return Err(lacks(&self.schema, "the numbers that a certificate states"));
        }
        if !certificate && self.controllers && self.contents.iter().all(held) {
            return Err(lacks(&self.schema, "what a controller needs"));
        }
        let others = FORMATS.iter().filter(|f| of(f).is_some());
        let others: Vec<&str> = others.map(|f| f.name).collect();
        Err(Message::bad_input(format!(
            "{} takes {}; this is {}",
            format.name,
            format.takes.results(),
            self.schema
        ))
        .remedy(format!("{} is taken by {}", self.schema, list(&others))))
    }
}

fn lacks(schema: &str, what: &str) -> Message {
    Message::bad_input(format!("the result {schema} lacks {what}"))
        .remedy("run the command again with this version of errsep")
}
