//! A machine against the parts made on it.

use std::collections::BTreeMap;

use errsep_models::machine::{Alignment, MeasuredParts};
use errsep_models::model::AnyModel;

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::io::Message;
use crate::io::machine::{Align, read_filed};
use crate::io::parts::read_parts;
use crate::io::units::urad_from_rad;
use crate::report::number::measured;

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let machine_file = args.setup.as_ref().ok_or_else(|| {
        Message::bad_input("the model of the machine is needed to diagnose parts")
            .remedy("give it with --setup MODEL.toml")
    })?;
    let filed = read_filed(machine_file, None)?;
    let files = [std::slice::from_ref(&args.data), &args.more].concat();
    let readings = read_parts(&files, &args.columns.map(), args.points.as_deref())?;
    let count = readings.len();
    let model = MeasuredParts::new(&filed.machine, readings)
        .map_err(|e| filed.wrong(&e, "keep the points within the tables of the machine"))?;
    let model = match filed.align {
        Align::Fixed => model,
        Align::Free => model.aligned().map_err(|e| {
            Message::bad_input(e.to_string())
                .in_file(&args.data)
                .remedy("give the nominal coordinates along the machine's axes, as the part lay")
        })?,
    };
    let mut notes = vec![
        "The machine is not fitted to the parts. The noise is that of measuring a part again; what differs between parts is gap.".to_owned(),
    ];
    notes.extend(alignment_in_words(&model));
    Case {
        readings: format!(
            "{count} readings of {}, against {}",
            match model.parts().len() {
                1 => "one part".to_owned(),
                many => format!("{many} parts"),
            },
            machine_file.display()
        ),
        along: "coordinate",
        notes,
        inputs: args.more.iter().chain(&args.points).cloned().collect(),
        model: AnyModel::new(&model),
    }
    .answer(args)
}

/// Where the parts lay, for parts that are aligned anew.
fn alignment_in_words(model: &MeasuredParts) -> Vec<String> {
    let (found, open) = model.alignments();
    let mut of_part: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for one in &found {
        of_part.entry(&one.part).or_default().push(in_words(one));
    }
    let mut notes = Vec::new();
    if model.is_aligned() {
        notes.push(
            "Zero and turn of each part belong to the model and are no causes; they are told of the middle of the part's \
             points, with the standard uncertainty from all that is left there, gap included."
                .to_owned(),
        );
    }
    for part in model.parts() {
        if let Some(words) = of_part.get(part.as_str()) {
            notes.push(format!("Part {part}: {}.", words.join("; ")));
        }
    }
    if !open.is_empty() {
        notes.push(format!("The points do not determine: {}.", open.join(", ")));
    }
    notes
}

fn in_words(one: &Alignment) -> String {
    let (value, std, unit) = match one.unit {
        "rad" => (urad_from_rad(one.value), urad_from_rad(one.std), "µrad"),
        _ => (one.value, one.std, "µm"),
    };
    format!("{} {} {unit}", one.name, measured(value, Some(std)))
}
