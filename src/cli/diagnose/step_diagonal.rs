//! Step-diagonal readings.

use errsep_models::diagonal::DiagonalRuns;
use errsep_models::model::{AnyModel, FittedModel};

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
    let (zone, readings) = read_readings(&args.data, &args.columns.map(), setup.test.target)?;
    let model = DiagonalRuns::new(&zone, &readings, &zero, setup.test.noise_um())
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
        model: AnyModel::new(&model),
        along: "along the diagonal",
        notes,
        inputs: Vec::new(),
    }
    .answer(args)
}
