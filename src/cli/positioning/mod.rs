//! `errsep positioning`: accuracy and repeatability of positioning (ISO 230-2, VDI 3441).

mod json;
mod words;

use std::path::PathBuf;

use clap::ValueEnum;
use errsep_models::positioning::{Direction, Positioning, analyse};

use super::{Answer, ColumnArgs, CommonArgs};
use crate::io::positioning::{AxisKind, PositioningData, PositioningSetup, read_readings};
use crate::io::units::LengthUnit;
use crate::io::{CsvTable, Message, Status};
use crate::report::positioning::{PositioningView, page};

/// Accuracy, repeatability and reversal of one axis (ISO 230-2, VDI 3441), with uncertainty.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
One row a reading:

    target,run,direction,position
    0,1,forward,0.0012
    50,1,forward,50.0031

| target    | target position, mm, of a rotary axis degrees                                |
| position  | actual position, likewise; or deviation, um (arcsec), in its place            |
| run       | 1, 2, …; optional                                                            |
| direction | forward (towards greater positions) or backward; optional                    |
| time      | seconds; optional, tells the drift                                           |
| temperature | degrees Celsius; optional, only its range is told                          |

The set-up, optional:

    [axis]
    name = \"X\"
    kind = \"linear\"           # or \"rotary\"
    unit = \"inch\"             # of positions and targets; absent: mm
    travel_from = 0.0
    travel_to = 500.0
    [uncertainty]             # expanded (k = 2), um (arcsec)
    device = 1.2              # over the measured length, in proportion to it
    misalignment = 0.3        # likewise
    expansion = 2.0           # likewise
    drift = 0.6               # of the difference of two means, alike in all runs

Example: errsep positioning readings.csv --setup setup.toml --out positioning")]
pub struct Args {
    /// The readings.
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// The set-up.
    #[arg(long, value_name = "SETUP.toml")]
    setup: Option<PathBuf>,
    /// Unit of positions and targets of a linear axis, in place of the set-up's.
    #[arg(long, value_enum, value_name = "mm|inch")]
    unit: Option<UnitName>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Units of the positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum UnitName {
    /// Millimetre.
    Mm,
    /// Inch, 25.4 mm.
    Inch,
}

/// Everything found, and what it was found from.
struct Found {
    setup: PositioningSetup,
    data: PositioningData,
    result: Positioning,
    warnings: Vec<String>,
}

/// Works out the figures of the test.
///
/// # Errors
/// The files cannot be read, or the readings are not those of a whole test.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let setup = match &args.setup {
        Some(path) => PositioningSetup::read(path)?,
        None => PositioningSetup::default(),
    };
    let unit = unit(args, &setup)?;
    let data = read_readings(&args.data, &args.columns.map(), setup.kind, unit)?;
    let result = analyse(&data.readings, &setup.influences, args.common.seed)
        .map_err(|e| data.refused(&e))?;
    let found = Found {
        warnings: words::warnings(&setup, &result),
        setup,
        data,
        result,
    };
    let name = args.data.display().to_string();
    let drift = words::drift(&found)?;
    Ok(Answer {
        text: words::in_words(&name, &found, drift.as_deref()),
        json: json::as_json(&found)?,
        page: args.common.page(|| {
            page(&PositioningView {
                data: &name,
                axis: found.setup.name.as_deref(),
                position_unit: found.setup.kind.position_unit(),
                deviation_unit: found.setup.kind.deviation_unit(),
                result: &found.result,
                contents: &words::contents(&found),
                withheld: &words::withheld(&found.result),
                drift: drift.as_deref(),
                warnings: &found.warnings,
            })
        }),
        tables: vec![points(&found)],
        inputs: std::iter::once(&args.data)
            .chain(&args.setup)
            .cloned()
            .collect(),
        setup: None,
        seed: Some(args.common.seed),
        status: Status::Done,
    })
}

fn unit(args: &Args, setup: &PositioningSetup) -> Result<LengthUnit, Message> {
    let given = args.unit.map(|unit| match unit {
        UnitName::Mm => LengthUnit::Mm,
        UnitName::Inch => LengthUnit::Inch,
    });
    if given.is_some() && setup.kind == AxisKind::Rotary {
        return Err(
            Message::bad_input("--unit is of a linear axis, this one is rotary")
                .remedy("leave --unit out: positions of a rotary axis are in degrees"),
        );
    }
    if let (Some(given), Some(own)) = (given, setup.unit)
        && given != own
    {
        return Err(
            Message::bad_input("--unit and [axis] unit of the set-up differ")
                .remedy("leave one of the two out"),
        );
    }
    Ok(given.or(setup.unit).unwrap_or(LengthUnit::Mm))
}

/// The points with what was found at each.
fn points(found: &Found) -> CsvTable {
    let (kind, result) = (found.setup.kind, &found.result);
    let (at, of) = (kind.position_unit(), kind.deviation_unit());
    let table = CsvTable::new("points.csv")
        .numbers(format!("target_{at}"), result.deviations.targets.clone());
    let table = Direction::ALL.into_iter().fold(table, |table, direction| {
        let mut table = table;
        if let Some(means) = result.profile.means(direction) {
            table = table.numbers(format!("mean_{}_{of}", direction.name()), means);
        }
        if let Some(stds) = result.profile.stds(direction) {
            table = table.numbers(format!("s_{}_{of}", direction.name()), stds);
        }
        table
    });
    let of_point = [
        ("mean", result.profile.bidirectional_means()),
        ("B", result.profile.reversals()),
        ("R", result.profile.repeatabilities()),
    ];
    of_point
        .into_iter()
        .fold(table, |table, (name, values)| match values {
            Some(values) => table.numbers(format!("{name}_{of}"), values),
            None => table,
        })
}
