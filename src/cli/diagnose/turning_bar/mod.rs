//! A bar that turns in the spindle while the slide feeds.

mod json;
mod told;
mod view;

use errsep_models::reversal::turning_bar::{Run, Survey, analyse};

use super::{Args, within_reach_in};
use crate::cli::{Answer, progress};
use crate::diagnosis::turning::{BAR_BEND, RECORDED_ANGLE, UNSTEADY_TURN, weigh};
use crate::io::turning::{read, read_setup};
use crate::io::{CsvTable, Message, Status};
use crate::report::turning_bar as sheet;

use told::Told;

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    refuse_options(args)?;
    let plan = match &args.setup {
        Some(path) => read_setup(path)?,
        None => errsep_models::reversal::turning_bar::Plan::default(),
    };
    let map = args.columns.map();
    let file = read(&args.data, &map)?;
    for r in &file.readings {
        let at = format!("x = {:e}", r.x);
        within_reach_in("a reading", r.value, &at, &args.data)?;
        within_reach_in("a position", r.x, &at, &args.data)?;
        within_reach_in("a time", r.time.unwrap_or(0.0), &at, &args.data)?;
        within_reach_in("an angle", r.spindle.unwrap_or(0.0), &at, &args.data)?;
    }
    let refuse = |why| file.refusal(&args.data, &why);
    let bar = progress("fitting", None);
    let run = Run::new(&file.readings).map_err(refuse)?;
    let setting = &plan.setting;
    let survey = Survey::new(
        &run,
        setting.indicator_rad,
        setting.handed,
        setting.about_hz,
    )
    .map_err(refuse)?;
    let mut analysis = analyse(&run, &survey, &plan).map_err(refuse)?;
    analysis.hold_out(&run, &survey);
    bar.finish_and_clear();
    let weighed = weigh(&run, &analysis, args.false_alarm, &args.without);
    let told = Told::new(&run, &survey, &analysis, &weighed);
    let data = args.data.display().to_string();
    let mut inputs = vec![args.data.clone()];
    inputs.extend(args.setup.clone());
    Ok(Answer {
        text: told.text(&data),
        json: json::json(&told),
        page: args.common.page(|| sheet::page(&view::view(data, &told))),
        tables: args.common.tables(|| tables(&told)),
        inputs,
        setup: None,
        seed: None,
        status: Status::Done,
    })
}

/// Options of the diagnosis that this model does not have.
fn refuse_options(args: &Args) -> Result<(), Message> {
    let options = [
        (!args.with.is_empty(), "--with"),
        (args.effects.is_some(), "--effects"),
        (args.learn.is_some(), "--learn"),
        (args.prove.is_some(), "--prove"),
    ];
    if let Some((_, option)) = options.iter().find(|o| o.0) {
        return Err(
            Message::bad_input(format!("{option} cannot be had with a bar that turns")).remedy(
                "leave it out: the diagnosis fits each explanation whole, and adds what it names",
            ),
        );
    }
    let known = [UNSTEADY_TURN, BAR_BEND, RECORDED_ANGLE];
    match args.without.iter().find(|name| !known.contains(&&name[..])) {
        Some(name) => Err(Message::bad_input(format!("there is no effect `{name}`"))
            .remedy(format!("the catalogue has {}", known.join(", ")))),
        None => Ok(()),
    }
}

/// Residuals, turn and axis of the bar.
fn tables(told: &Told) -> Vec<CsvTable> {
    let run = told.run;
    let mut tables = vec![
        CsvTable::new("residuals.csv")
            .numbers("time", run.time.clone())
            .numbers("x_mm", run.x.clone())
            .numbers("side_deg", told.sides())
            .numbers("before_um", told.analysis.steady.fit.residuals.clone())
            .numbers("after_um", told.chosen.fit.residuals.clone()),
        CsvTable::new("bar.csv")
            .numbers("x_mm", told.places.clone())
            .numbers("e_1_um", told.axis.iter().map(|a| a.0).collect::<Vec<_>>())
            .numbers("e_2_um", told.axis.iter().map(|a| a.1).collect::<Vec<_>>())
            .numbers(
                "form_um",
                told.form.iter().map(|f| f.value).collect::<Vec<_>>(),
            )
            .numbers(
                "form_std_um",
                told.form.iter().map(|f| f.std).collect::<Vec<_>>(),
            ),
    ];
    if let Some(curve) = &told.curve {
        let degrees = |all: &[f64]| all.iter().map(|v| v.to_degrees()).collect::<Vec<_>>();
        tables.push(
            CsvTable::new("turn.csv")
                .numbers("time", curve.time.clone())
                .numbers("x_mm", curve.x.clone())
                .numbers("lag_deg", degrees(&curve.lag_rad))
                .numbers("lag_std_deg", degrees(&curve.lag_std))
                .numbers("turns_per_min", told.per_minute(&curve.speed)),
        );
    }
    tables
}
