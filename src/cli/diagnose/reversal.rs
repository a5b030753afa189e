//! A spindle and slideway reversal.

use errsep_models::model::FittedModel;
use errsep_models::reversal::diagnosable::{Assumptions, FirstOrder};

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::io::Message;
use crate::io::reversal::{ReversalSetup, read};

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let mut setup = match &args.setup {
        Some(path) => ReversalSetup::read(path)?,
        None => ReversalSetup::default(),
    };
    if let Some(columns) = &args.columns {
        setup.columns = columns.clone();
    }
    let data = read(&args.data, &setup.columns)?;
    let assumptions = Assumptions {
        convention: setup.convention,
        thickness: setup.thickness,
        noise: setup.noise,
    };
    let model = FirstOrder::new(&data.observations, assumptions)
        .map_err(|e| Message::bad_input(e.to_string()).in_file(&args.data))?;
    let mut notes = Vec::new();
    if !model.timed {
        notes.push("No times are given: the readings are taken to follow each other evenly, first spindle position first, each repeat forward and then backward.".to_owned());
    }
    let channels = model.channel_names();
    if channels.len() < 4 {
        notes.push(format!(
            "Of the four channels only {} {} there, so nothing closes: only what differs between repeats and directions is diagnosed, and what comes back in all of them goes unnoticed.",
            channels.join(", "),
            if channels.len() == 1 { "is" } else { "are" }
        ));
    }
    if model.left_out > 0 {
        notes.push(format!(
            "{} readings are at positions that not every trace has, and were not used.",
            model.left_out
        ));
    }
    Case {
        model,
        readings: data.in_words(),
        along: "slide position",
        notes,
        inputs: Vec::new(),
    }
    .answer(args)
}
