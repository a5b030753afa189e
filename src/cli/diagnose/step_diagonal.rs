//! Step-diagonal readings.

use errsep_models::diagonal::DiagonalRuns;
use errsep_models::model::FittedModel;

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::io::Message;
use crate::io::diagonal::{DiagonalSetup, read_readings};

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let (setup, zero) = match &args.setup {
        Some(path) => DiagonalSetup::read(path)?,
        None => (DiagonalSetup::default(), Vec::new()),
    };
    super::positive(setup.test.noise, "[test] noise", args)?;
    for measured in &setup.measured {
        let what = format!("[[measured]] std of {}", measured.axis.letter());
        super::positive(Some(measured.std), &what, args)?;
        if !measured.slope.is_finite() {
            let what = format!(
                "[[measured]] slope of {} = {} is no number",
                measured.axis.letter(),
                measured.slope
            );
            return Err(super::in_setup(Message::bad_input(what), args)
                .remedy("give the slope in um/mm, or leave the table out"));
        }
    }
    let (zone, readings) = read_readings(&args.data, setup.test.target)?;
    let model = DiagonalRuns::new(&zone, &readings, &zero, setup.test.noise)
        .map_err(|e| Message::bad_input(e.to_string()).in_file(&args.data))?;
    let mut notes = vec!["No times are known: the readings are taken to follow each other evenly in the order of the file.".to_owned()];
    if !setup.measured.is_empty() {
        notes.push("Slopes measured by other means do not take part in the diagnosis.".to_owned());
    }
    Case {
        readings: format!(
            "{} readings of {} runs",
            readings.len(),
            model.traces().len()
        ),
        model,
        along: "along the diagonal",
        notes,
        inputs: Vec::new(),
    }
    .answer(args)
}
