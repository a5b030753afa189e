//! A spindle and slideway reversal.

use std::collections::HashMap;
use std::sync::Arc;

use errsep_models::model::{AnyModel, FittedModel, Place};
use errsep_models::reversal::Direction;
use errsep_models::reversal::designs::{self, DesignFit};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised, NotDiagnosable};
use errsep_models::reversal::effects::joins_the_fit;
use serde_json::Value;

use super::Args;
use super::case::Case;
use super::joined::{Given, followed_by};
use super::within_reach_of;
use crate::cli::Answer;
use crate::cli::reversal::{design_options as options, no_crest};
use crate::io::Message;
use crate::io::reversal::{DesignData, Readings, ReversalSetup, read_any};
use crate::report::number;

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let mut setup = match &args.setup {
        Some(path) => ReversalSetup::read(path)?,
        None => ReversalSetup::default(),
    };
    if args.columns.are_given() {
        setup.columns = args.columns.map();
    }
    let data = match read_any(&args.data, &setup)? {
        Readings::Four(data) => {
            no_crest(&setup, args.setup.as_deref())?;
            data
        }
        Readings::Other(data) => return of_design(args, &setup, &data),
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
    let model = Linearised::new(&data.observations, assumptions(&setup))
        .map_err(|why| refusal(&why).in_file(&args.data))?;
    let notes = notes(&model);
    let mut answer = Case {
        model: AnyModel::new(&model),
        readings: data.in_words(),
        along: ALONG,
        notes,
        inputs: Vec::new(),
    }
    .answer_with(args, |plan| Some(planned(plan, &setup, &model)))?;
    if let Some(command) = with_command(args, &answer.json) {
        told_command(&mut answer, command);
    }
    Ok(answer)
}

fn of_design(args: &Args, setup: &ReversalSetup, data: &DesignData) -> Result<Answer, Message> {
    let model = design_model(setup, data, None).map_err(|why| refusal(&why).in_file(&args.data))?;
    let design = &data.observations.design;
    let case = Case {
        readings: format!(
            "{}; {} of {} in {} of the spindle",
            data.in_words(),
            number::counted(design.channels().len(), "channel"),
            number::counted(design.indicators().len(), "indicator"),
            number::counted(design.positions().len(), "position")
        ),
        notes: with_crest(setup, notes(&model)),
        model: AnyModel::new(&model),
        along: ALONG,
        inputs: Vec::new(),
    };
    let mut answer = case.answer_with(args, |plan| Some(planned(plan, setup, &model)))?;
    let names = named(&answer.json);
    if args.with.is_empty() && !names.is_empty() {
        let mut command = format!("errsep reversal {}", args.data.display());
        if let Some(setup) = &args.setup {
            command += &format!(" --setup {}", setup.display());
        }
        command += &format!(" --simultaneous --with {}", names.join(","));
        if args.columns.are_given() {
            command += ", with the same --columns";
        }
        told_command(&mut answer, command);
    }
    Ok(answer)
}

/// How many readings stand for one of a model.
fn readings_of_one(model: &Linearised) -> f64 {
    (model.gathered.as_ref()).map_or(1.0, |gathered| gathered.readings_per_cell)
}

/// Part by which these numbers of a plan and of a measurement may differ.
const ALIKE: f64 = 0.1;

/// The model of a plan of a measurement like one that has been made.
fn planned(plan: &Args, setup: &ReversalSetup, measured: &Linearised) -> Result<AnyModel, Message> {
    let gathered = readings_of_one(measured);
    let model = match read_any(&plan.data, setup)? {
        Readings::Four(data) => Linearised::new(&data.observations, assumptions(setup)),
        Readings::Other(data) => design_model(setup, &data, None),
    };
    let model = model.map_err(|why| refusal(&why).in_file(&plan.data))?;
    if model.left_out > 0 {
        return Err(
            Message::bad_input("the planned traces have positions of their own")
                .in_file(&plan.data)
                .remedy("plan the same positions for every trace"),
        );
    }
    let own = readings_of_one(&model);
    if (own / gathered - 1.0).abs() > ALIKE {
        return Err(Message::bad_input(format!(
            "of the plan {} readings stand for one, of the measurement {}: the noise of their means is another",
            number::plain(own, 2),
            number::plain(gathered, 2)
        ))
        .in_file(&plan.data)
        .remedy("plan the positions that were measured"));
    }
    Ok(AnyModel::new(&model.with_heights_as(measured)))
}

/// The fitted model of a design, with the fit of its readings where there is one.
///
/// # Errors
/// As [`Linearised::of_design`].
pub fn design_model(
    setup: &ReversalSetup,
    data: &DesignData,
    fit: Option<&DesignFit>,
) -> Result<Linearised, NotDiagnosable> {
    if setup.crest.is_none() {
        return Linearised::of_design(&data.observations, setup.zero, fit, assumptions(setup));
    }
    let own;
    let fit = match fit {
        Some(fit) => fit,
        None => {
            let failed = |why: String| NotDiagnosable::NoFit(why);
            let options = options(setup, data).map_err(|why| failed(why.to_string()))?;
            own = designs::fit(&data.observations, &options)
                .map_err(|why| failed(why.to_string()))?;
            &own
        }
    };
    // What the set-up states of the crest is taken out of the readings; a fit that has the term would carry
    // them back to where it was.
    let mut observations = data.observations.clone();
    for reading in &mut observations.readings {
        let lost = fit.lost(reading.channel, reading.x);
        reading.value += lost.map_err(|why| NotDiagnosable::NoFit(why.to_string()))?;
    }
    Linearised::of_design(&observations, setup.zero, None, assumptions(setup))
}

/// A design's answer with the fit that effects have joined behind it, and what they change in each
/// reading of the file, µm.
///
/// # Errors
/// The effects are not known or the readings do not determine them; and why changes cannot be told
/// reading by reading, where that is asked for.
pub fn design_with(
    answer: Answer,
    given: &Given<'_>,
    setup: &ReversalSetup,
    data: &DesignData,
    fit: &DesignFit,
) -> Result<(Answer, Option<Vec<f64>>), Message> {
    let model =
        design_model(setup, data, Some(fit)).map_err(|why| refusal(&why).in_file(given.data))?;
    let places = Arc::clone(&model.record().places);
    let whole = model.gathered.is_none() && model.left_out == 0;
    let case = Case {
        readings: data.in_words(),
        notes: notes(&model),
        model: AnyModel::new(&model),
        along: ALONG,
        inputs: Vec::new(),
    };
    within_reach_of(&case.model, ALONG, given.data)?;
    let (joined, fitted) = case.with_effects(&given.args())?;
    let changes = whole.then(|| by_reading(data, &places, &fitted.change));
    Ok((followed_by(answer, joined), changes))
}

/// What is told at places, in the order of the file.
fn by_reading(data: &DesignData, places: &[Place], told: &[f64]) -> Vec<f64> {
    let key = |channel: usize, repeat: u32, backward: bool, x: f64| {
        (channel, repeat, backward, (x * 1e4).round() as i64)
    };
    let of_place =
        |(p, value): (&Place, &f64)| (key(p.channel, p.repeat, p.direction < 0.0, p.x), *value);
    let known: HashMap<_, f64> = places.iter().zip(told).map(of_place).collect();
    let readings = data.observations.readings.iter();
    readings
        .map(|r| {
            let backward = r.direction == Direction::Backward;
            let own = known.get(&key(r.channel, r.repeat, backward, r.x));
            own.copied().unwrap_or(0.0)
        })
        .collect()
}

/// Adds the command that fits what was named along with the model.
fn told_command(answer: &mut Answer, command: String) {
    answer.text += &format!(
        "\nFor the answer with it, and its uncertainty, fit it along with tilts and forms: {command}\n"
    );
    if let Value::Object(object) = &mut answer.json {
        object.insert("fit_with".to_owned(), command.into());
    }
}

/// The effects of a verdict.
fn named(diagnosis: &Value) -> Vec<String> {
    let names = diagnosis["verdict"]["effects"].as_array();
    let words = names.into_iter().flatten().filter_map(Value::as_str);
    words.map(str::to_owned).collect()
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
    if args.columns.are_given() {
        command += ", with the same --columns";
    }
    Some(command)
}

/// What people should know of readings as they are diagnosed.
pub fn notes(model: &Linearised) -> Vec<String> {
    let mut notes = Vec::new();
    if !model.timed {
        notes.push("No times are given: the readings are taken to follow each other evenly, first spindle position first, each repeat forward and then backward.".to_owned());
    }
    let channels = model.channel_names();
    if !model.arrangement().is_four() {
        notes.extend(notes_on_design(model));
    } else if channels.len() < 4 {
        notes.push(format!(
            "Of the four channels only {} {} there, so nothing closes: only what differs between repeats and directions is diagnosed, and what comes back in all of them goes unnoticed.",
            channels.join(", "),
            if channels.len() == 1 { "is" } else { "are" }
        ));
    }
    let carried = model
        .gathered
        .as_ref()
        .filter(|gathered| gathered.filled() == 0);
    if let Some(gathered) = carried {
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
        let between = gathered.between_grids();
        if between > 0.0 {
            notes.push(format!(
                "Channels are read at positions of their own: what the forms may be between those of one and those of another, {} µm (standard deviation in a place, from what neighbouring places differ by), counts as form.",
                number::plain(between, 2)
            ));
        }
    }
    let filled = model
        .gathered
        .as_ref()
        .map_or(0, |gathered| gathered.filled());
    if filled > 0 {
        notes.push(format!(
            "{filled} readings that single traces lack at places which the others have were put in, by what the traces of their channel have in common; they bring nothing of their own, so the noise is told greater than the repeats show it, and uncertainties with it."
        ));
    }
    if let Some(rounding) = model.rounded_to() {
        notes.push(format!(
            "Readings are rounded to {} µm, more coarsely than they scatter (about {} µm before): repeats have an error of {} µm of it in common, which is no gap.",
            number::plain(rounding.step, 3),
            number::plain(rounding.noise, 2),
            number::plain(rounding.std(), 2)
        ));
    }
    if let Some(greatest) = model.levelled_um {
        notes.push(format!(
            "The traces of a channel differ in height, by up to {} µm from their mean, as where an indicator is set to zero before each of them; their heights are unknowns of the fit, the gap is what is left beside them, and what shows in heights alone is not seen.",
            number::plain(greatest, 2)
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

/// The notes, and that a stated crest is taken out.
pub fn with_crest(setup: &ReversalSetup, mut notes: Vec<String>) -> Vec<String> {
    if setup.crest.is_some() {
        notes.push("What the styluses lose beside the crest is taken out of the readings as the set-up states it; off-crest is what may be left of that.".to_owned());
    }
    notes
}

/// What people should know of a design as it is diagnosed.
fn notes_on_design(model: &Linearised) -> Vec<String> {
    let determined = model.arrangement().determined();
    let (forms, slopes) = (&determined.forms, &determined.slopes);
    match (forms.to_spare(), slopes.to_spare()) {
        (0, 0) => vec![
            "Nothing closes in this design: only what differs between repeats and directions is diagnosed, and what comes back in all of them goes unnoticed.".to_owned(),
        ],
        (0, _) => vec![
            "No forms close in this design: what comes back in all repeats shows in slopes alone.".to_owned(),
        ],
        _ => Vec::new(),
    }
}

/// Why readings cannot be diagnosed, and what to do.
pub fn refusal(why: &NotDiagnosable) -> Message {
    match why {
        NotDiagnosable::NoFit(_) => Message::not_converged(why.to_string())
            .remedy("`errsep reversal --simultaneous` with the same readings says more"),
        NotDiagnosable::RangesDiffer => Message::bad_input(why.to_string())
            .remedy("read every channel over the same range of x, at five or more places"),
        NotDiagnosable::NothingLeft { .. } => Message::bad_input(why.to_string())
            .remedy("add the missing channels (in a design, such that something closes), the other direction or repeats"),
    }
}
