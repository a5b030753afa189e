//! A spindle and slideway reversal.

use errsep_models::model::FittedModel;
use errsep_models::reversal::diagnosable::{Assumptions, FirstOrder, NotDiagnosable};
use errsep_models::reversal::effects::joins_the_fit;
use serde_json::Value;

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::io::Message;
use crate::io::reversal::{ReversalSetup, read};
use crate::report::number;

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let mut setup = match &args.setup {
        Some(path) => ReversalSetup::read(path)?,
        None => ReversalSetup::default(),
    };
    if !args.with.is_empty() {
        return Err(Message::bad_input(
            "effects join a reversal in exact geometry, by a command of its own",
        )
        .remedy(format!(
            "errsep reversal {} --simultaneous --with {}",
            args.data.display(),
            args.with.join(",")
        )));
    }
    if let Some(columns) = &args.columns {
        setup.columns = columns.clone();
    }
    let data = read(&args.data, &setup.columns)?;
    let model = FirstOrder::new(&data.observations, assumptions(&setup))
        .map_err(|why| refusal(&why).in_file(&args.data))?;
    let notes = notes(&model);
    let mut answer = Case {
        model,
        readings: data.in_words(),
        along: ALONG,
        notes,
        inputs: Vec::new(),
    }
    .answer(args)?;
    if let Some(command) = with_command(args, &answer.json) {
        answer.text += &format!(
            "\nFor the answer with it, and its uncertainty, fit it along with tilts and forms: {command}\n"
        );
        if let Value::Object(object) = &mut answer.json {
            object.insert("fit_with".to_owned(), command.into());
        }
    }
    Ok(answer)
}

/// Name of the positions.
pub const ALONG: &str = "slide position";

/// What a set-up says of the measurement.
pub fn assumptions(setup: &ReversalSetup) -> Assumptions {
    Assumptions {
        convention: setup.convention,
        thickness: setup.thickness,
        noise: setup.noise,
    }
}

/// The command that fits the effects that were named along with tilts and forms, where all of them can
/// be.
fn with_command(args: &Args, diagnosis: &Value) -> Option<String> {
    let names: Vec<&str> = diagnosis["verdict"]["effects"]
        .as_array()?
        .iter()
        .filter_map(Value::as_str)
        .collect();
    let candidates = diagnosis["candidates"].as_array()?;
    let variant = |name: &str| {
        let own = candidates.iter().find(|c| c["effect"] == name);
        own.and_then(|c| c["variant"].as_str())
    };
    let joins = |name: &&str| joins_the_fit(name, variant(name));
    if names.is_empty() || !names.iter().all(joins) {
        return None;
    }
    let mut command = format!("errsep reversal {}", args.data.display());
    if let Some(setup) = &args.setup {
        command += &format!(" --setup {}", setup.display());
    }
    command += &format!(" --simultaneous --with {}", names.join(","));
    if args.columns.is_some() {
        command += ", with the same --columns";
    }
    Some(command)
}

/// What people should know of readings as they are diagnosed.
pub fn notes(model: &FirstOrder) -> Vec<String> {
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
    if let Some(gathered) = &model.gathered {
        notes.push(format!(
            "The traces have {}: their readings were carried to {} common places by the simultaneous fit, {} readings to each; noise is that of their mean.",
            if gathered.readings_per_cell > 1.5 {
                "many positions"
            } else {
                "positions of their own"
            },
            gathered.cells,
            number::plain(gathered.readings_per_cell, 2)
        ));
    }
    if model.left_out > 0 {
        notes.push(format!(
            "{} readings are at positions that not every trace has, and were not used.",
            model.left_out
        ));
    }
    notes
}

/// Why readings cannot be diagnosed, and what to do.
pub fn refusal(why: &NotDiagnosable) -> Message {
    match why {
        NotDiagnosable::NoFit(_) => Message::not_converged(why.to_string())
            .remedy("`errsep reversal --simultaneous` with the same readings says more"),
        NotDiagnosable::RangesDiffer => Message::bad_input(why.to_string())
            .remedy("read every channel over the same range of x, at five or more places"),
        NotDiagnosable::NothingLeft { .. } => Message::bad_input(why.to_string())
            .remedy("add the missing channels, the other direction or repeats"),
    }
}
