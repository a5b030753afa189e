//! Outputs of four sensors.

use errsep_models::four_sensor::FourSensors;
use errsep_models::model::AnyModel;

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::cli::four_sensor::read::read;
use crate::cli::four_sensor::setup::Setup;
use crate::io::{Message, SetupFile};
use crate::report::number::counted;

/// Most points of surface: what the fit absorbs is a dense matrix here.
const MOST: usize = 400;

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let Some(path) = &args.setup else {
        return Err(
            Message::bad_input("the spacing of the sensors is not known")
                .remedy("give the set-up of errsep four-sensor with --setup"),
        );
    };
    let setup = Setup::read(SetupFile::read(path)?)?;
    let measured = read(&args.data, &args.columns.map(), &setup)?;
    measured.whole(&args.data)?;
    let points = measured.outputs.geometry().point_count();
    if points > MOST {
        return Err(Message::bad_input(format!(
            "{points} points of the surface are more than the {MOST} that are diagnosed together"
        ))
        .in_file(&args.data)
        .remedy("diagnose a part of the travel"));
    }
    for (k, reading) in measured.outputs.readings().iter().enumerate() {
        let at = format!("slide position {}", k + 1);
        for value in reading {
            super::within_reach("a reading", *value, &at, args)?;
        }
    }
    let model = FourSensors::new(&measured.each, setup.settings.noise)
        .map_err(|e| Message::not_determined(e.to_string()).in_file(&args.data))?;
    Case {
        readings: format!(
            "four sensors at {}, {}",
            counted(measured.outputs.readings().len(), "slide position"),
            counted(measured.repeats, "repeat")
        ),
        model: AnyModel::new(&model),
        along: "slide position",
        notes: vec!["Surface, straightness and tilt are free at every position: what all sensors share in pairs of them cannot be seen.".to_owned()],
        inputs: Vec::new(),
    }
    .answer(args)
}
