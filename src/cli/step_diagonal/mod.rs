//! `errsep step-diagonal`: diagonal and step-diagonal displacement tests.

mod json;
mod tables;
mod text;

use std::path::PathBuf;

use errsep_models::diagonal::{
    Assumptions, ClosedForm, Diagonal, DiagonalError, DiagonalReading, DiagonalTotals, Measured,
    SequenceChoice, StepDiagonalFit, Target, WorkZone, choose_sequences, closed_forms, regress,
    totals,
};
use errsep_models::uncertainty::DegreesOfFreedom;

use super::diagnose::joined::{self, Given};
use super::{Answer, ColumnArgs, CommonArgs, disagreement};
use crate::io::diagonal::{DiagonalSetup, read_readings};
use crate::io::{Message, Status};
use crate::report::step_diagonal::{StepDiagonalView, page};

/// Diagonal and step-diagonal displacement tests (ISO 230-6): what they determine and what not.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
One row a stop of the laser, zeroed at the start of each run:

    diagonal,sequence,x,y,z,reading
    AG,XYZ,0,0,0,0.00
    AG,XYZ,120,0,0,-1.31

| diagonal | AG, BH, CE, DF (body), AC, DB (face of the bottom plane), A at the least x, y, z |
| sequence | XYZ, XZY, YXZ, YZX, ZXY, ZYX, or together for the diagonal test              |
| x, y, z  | machine position, mm, the same number of even steps on each axis               |
| reading  | displacement read along the beam less the nominal one, um                      |
| target   | mirror or retro-reflector; optional, as is repeat                              |
| direction| forward, or backward on the way back without zeroing the laser; optional       |

The set-up, optional:

    [test]
    target = \"mirror\"
    noise = 0.2                   # um; absent: estimated
    [assume]
    zero = [\"ECX\"]                # errors taken as zero
    [[measured]]
    axis = \"X\"                    # positioning slope by a laser along the axis
    slope = 0.004                 # um/mm
    std = 0.0005
    degrees_of_freedom = 9        # absent: infinite

Example: errsep step-diagonal readings.csv --setup setup.toml --out diagonal")]
pub struct Args {
    /// The readings.
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// The set-up.
    #[arg(long, value_name = "S.toml")]
    setup: Option<PathBuf>,
    /// Adds which sets of sequences would determine which angular errors.
    #[arg(long)]
    choose: bool,
    /// Fit these effects along with the model, by the names of `errsep diagnose`: the answer is given without
    /// and with them, with one covariance.
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',')]
    with: Vec<String>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Everything found.
struct Found {
    zone: WorkZone,
    readings: Vec<DiagonalReading>,
    fit: StepDiagonalFit,
    forms: Vec<ClosedForm>,
    totals: DiagonalTotals,
    choices: Vec<SequenceChoice>,
    /// What the reader has to weigh.
    remarks: Vec<String>,
}

/// Analyses the readings.
///
/// # Errors
/// The files cannot be read, the readings make no grid, or the regression fails.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let (setup, zero) = match &args.setup {
        Some(path) => DiagonalSetup::read(path)?,
        None => (DiagonalSetup::default(), Vec::new()),
    };
    let (zone, readings) = read_readings(&args.data, &args.columns.map(), setup.test.target)?;
    let assumptions = Assumptions {
        zero,
        slopes: setup
            .measured
            .iter()
            .map(|m| Measured {
                axis: m.axis,
                slope: *m.slope.get_ref(),
                std: *m.std.get_ref(),
                degrees_of_freedom: m.degrees_of_freedom.unwrap_or(DegreesOfFreedom::Infinite),
            })
            .collect(),
        noise: setup.test.noise_um(),
    };
    let refused = |e: DiagonalError| {
        let message = match e {
            DiagonalError::Numerical { .. } => Message::not_converged(e.to_string()),
            DiagonalError::MeasuredUncertainty { .. } => Message::bad_input(e.to_string())
                .remedy("give the slope and its standard uncertainty in um/mm"),
            _ => Message::bad_input(e.to_string()).remedy("see `errsep step-diagonal --help`"),
        };
        message.in_file(&args.data)
    };
    let mut found = Found {
        fit: regress(&zone, &readings, &assumptions).map_err(refused)?,
        forms: closed_forms(&zone, &readings).map_err(refused)?,
        totals: totals(&zone, &readings).map_err(refused)?,
        choices: Vec::new(),
        remarks: Vec::new(),
        zone,
        readings,
    };
    if let (Some(refuted), Some(stated)) = (found.fit.disagreement, assumptions.noise) {
        let seen = "Readings and model disagree";
        let words = disagreement::in_words(refuted, seen, "the set-up states", stated);
        found.remarks.push(words);
    }
    if args.choose {
        let (diagonals, targets) = used(&found.readings);
        found.choices = choose_sequences(&found.zone, &diagonals, &targets).map_err(refused)?;
    }
    let name = args.data.display().to_string();
    let answer = Answer {
        text: text::in_words(&name, &found)?,
        json: json::as_json(&found, &assumptions)?,
        page: args.common.page(|| {
            page(&StepDiagonalView {
                data: &name,
                fit: &found.fit,
                forms: &found.forms,
                totals: &found.totals,
                choices: &found.choices,
                remarks: &found.remarks,
            })
        }),
        tables: vec![tables::components(&found.fit), tables::residuals(&found)],
        inputs: std::iter::once(&args.data)
            .chain(&args.setup)
            .cloned()
            .collect(),
        setup: None,
        seed: None,
        status: Status::Done,
    };
    joined::beside(
        answer,
        &Given {
            setup: args.setup.as_deref(),
            columns: args.columns.clone(),
            ..Given::to("step-diagonal", &args.data, &args.with, &args.common)
        },
    )
}

fn used(readings: &[DiagonalReading]) -> (Vec<Diagonal>, Vec<Target>) {
    let mut diagonals: Vec<Diagonal> = readings.iter().map(|r| r.diagonal).collect();
    diagonals.sort_unstable();
    diagonals.dedup();
    let mut targets: Vec<Target> = readings.iter().map(|r| r.target).collect();
    targets.sort_unstable();
    targets.dedup();
    (diagonals, targets)
}
