//! A machine against the parts made on it.

use errsep_models::machine::MeasuredParts;

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::io::Message;
use crate::io::machine::{read_filed, read_points};
use crate::io::parts::read_parts;

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let needed = |what: &str, option: &str| {
        Message::bad_input(format!("{what} is needed to diagnose parts"))
            .remedy(format!("give it with {option}"))
    };
    let machine_file = args
        .setup
        .as_ref()
        .ok_or_else(|| needed("the model of the machine", "--setup MODEL.toml"))?;
    let points_file = args
        .points
        .as_ref()
        .ok_or_else(|| needed("the table of the points", "--points POINTS.csv"))?;
    let filed = read_filed(machine_file, None)?;
    let points = read_points(points_file)?;
    let readings = read_parts(&args.data, &points)?;
    let count = readings.len();
    let model = MeasuredParts::new(&filed.machine, readings)
        .map_err(|e| filed.wrong(&e, "keep the points within the tables of the machine"))?;
    Case {
        readings: format!(
            "{count} readings of {} parts, against {}",
            model.parts().len(),
            machine_file.display()
        ),
        along: "coordinate",
        notes: vec![
            "The machine is not fitted to the parts. The noise is that of measuring a part again; what differs between parts is gap.".to_owned(),
        ],
        inputs: vec![points_file.clone()],
        model,
    }
    .answer(args)
}
