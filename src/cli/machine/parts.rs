//! Measured parts against the prediction.

use std::fmt::Write;
use std::path::PathBuf;

use errsep_models::machine::{Axis, PartReading, PartResidual, part_residuals};
use serde_json::{Value, json};

use super::{Context, PropagationArgs};
use crate::cli::{Answer, ColumnArgs, CommonArgs};
use crate::io::parts::read_parts;
use crate::io::{CsvTable, Message, Status};
use crate::report::plot::{Axis as PlotAxis, Chart, Series};
use crate::report::{Cell, Figure, Page, Section, Standing, Table, number};

/// Measured parts against the prediction of the machine: is its uncertainty enough?
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The readings have the columns part, point, axis (x, y or z), value (measured less nominal, um) and
where it applies replicate, with the places of the points in --points. Or they are tables as a measuring
machine prints them, a file a part, nominal coordinates beside measured ones or deviations (mm unless a
unit stands beside), whatever text is before:

    point  nominal x  nominal y  measured x  measured y

The machine is not fitted to them.

Examples:
    errsep machine machine.toml parts readings.csv --points holes.csv --out parts
    errsep machine machine.toml parts plate-1.txt plate-2.txt")]
pub(super) struct Args {
    /// The measured parts; several files hold parts of their own.
    #[arg(value_name = "READINGS.csv", required = true)]
    readings: Vec<PathBuf>,
    /// The points (columns point, x, y and z, mm), where the readings have no nominal coordinates.
    #[arg(long, value_name = "POINTS.csv")]
    points: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) propagation: PropagationArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// The residuals at one point along one axis.
struct Feature<'a> {
    name: String,
    axis: Axis,
    residuals: Vec<&'a PartResidual>,
}

impl Feature<'_> {
    fn mean(&self) -> f64 {
        self.residuals.iter().map(|r| r.residual).sum::<f64>() / self.residuals.len() as f64
    }

    fn rms(&self) -> f64 {
        let squares: f64 = self.residuals.iter().map(|r| r.residual.powi(2)).sum();
        (squares / self.residuals.len() as f64).sqrt()
    }

    fn predicted(&self) -> (f64, f64) {
        self.residuals.first().map_or((f64::NAN, f64::NAN), |r| {
            (r.predicted, r.standard_uncertainty)
        })
    }

    /// Root mean square residual in units of the predicted uncertainty.
    fn ratio(&self) -> f64 {
        self.rms() / self.predicted().1
    }
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Answer, Message> {
    let readings: Vec<PartReading> =
        read_parts(&args.readings, &args.columns.map(), args.points.as_deref())?;
    let residuals =
        part_residuals(context.machine, &readings).map_err(|error| context.wrong(&error))?;
    let mut features: Vec<Feature> = Vec::new();
    for residual in &residuals {
        let r = &residual.reading;
        match features
            .iter_mut()
            .find(|f| f.name == r.feature && f.axis == r.axis)
        {
            Some(feature) => feature.residuals.push(residual),
            None => features.push(Feature {
                name: r.feature.clone(),
                axis: r.axis,
                residuals: vec![residual],
            }),
        }
    }
    let inside = residuals
        .iter()
        .filter(|r| r.normalized().is_some_and(|z| z.abs() <= 2.0))
        .count();
    let share = inside as f64 / residuals.len() as f64;
    let sentence = format!(
        "{} of {} readings lie within two predicted standard uncertainties.",
        number::percent(share),
        residuals.len()
    );
    let standing = if share >= 0.9 {
        Standing::Good
    } else {
        Standing::Caution
    };
    let machine = context.args.model.display().to_string();
    let files: Vec<String> = args
        .readings
        .iter()
        .map(|f| f.display().to_string())
        .collect();
    let mut text = format!(
        "Parts of {} against {machine}\n\n{sentence}\n\n",
        files.join(", ")
    );
    let _ = writeln!(
        text,
        "point axis   predicted µm   mean residual µm   rms µm   rms / predicted u"
    );
    for f in &features {
        let (value, u) = f.predicted();
        let _ = writeln!(
            text,
            "{:5} {:4} {:>14} {:>18} {:>8} {:>19}",
            f.name,
            f.axis.letter(),
            number::measured(value, Some(u)),
            number::fixed(f.mean(), 2),
            number::fixed(f.rms(), 2),
            number::plain(f.ratio(), 3)
        );
    }
    Ok(Answer {
        text,
        json: json!({
            "schema": "errsep.machine/1",
            "action": "parts",
            "chain": context.machine.chain().to_string(),
            "readings": residuals.len(),
            "within_two_standard_uncertainties": share,
            "points": features.iter().map(as_json).collect::<Vec<_>>(),
        }),
        page: page(&machine, &sentence, standing, &features),
        tables: vec![csv(&residuals)],
        inputs: [context.inputs(args.points.as_ref()), args.readings.clone()].concat(),
        setup: None,
        seed: None,
        status: Status::Done,
    })
}

fn as_json(f: &Feature) -> Value {
    let (value, u) = f.predicted();
    json!({
        "point": f.name,
        "axis": f.axis.letter().to_string(),
        "predicted": {"value": value, "std": u, "unit": "um"},
        "mean_residual": f.mean(),
        "rms_residual": f.rms(),
        "ratio": f.ratio(),
        "readings": f.residuals.len(),
    })
}

fn page(machine: &str, sentence: &str, standing: Standing, features: &[Feature]) -> Page {
    let chart = Chart::new(
        PlotAxis::new("point and axis, in the order of the file", "").whole(),
        PlotAxis::new("residual", "µm"),
    );
    let (mut at, mut value) = (Vec::new(), Vec::new());
    for (i, f) in features.iter().enumerate() {
        for r in &f.residuals {
            at.push(i as f64 + 1.0);
            value.push(r.residual);
        }
    }
    let numbers: Vec<f64> = (1..=features.len()).map(|i| i as f64).collect();
    let limits = features.iter().map(|f| 2.0 * f.predicted().1).collect();
    let chart = chart
        .series(Series::line("prediction", numbers, vec![0.0; features.len()]).half_band(limits))
        .series(Series::points("reading", at, value));
    let table = features.iter().fold(
        Table::new(
            "By point and axis",
            [
                "point",
                "axis",
                "predicted (µm)",
                "mean residual (µm)",
                "rms (µm)",
                "rms / predicted u",
            ],
        ),
        |table, f| {
            let (value, u) = f.predicted();
            table.row([
                f.name.as_str().into(),
                f.axis.letter().to_string().into(),
                Cell::measured(value, u),
                Cell::number(f.mean()),
                Cell::number(f.rms()),
                Cell::number(f.ratio()),
            ])
        },
    );
    Page::new("Machine: measured parts", machine)
        .summary(standing, sentence)
        .section(
            Section::new("Residuals")
                .figure(Figure::new(
                    "Measured less predicted",
                    "Band: twice the predicted standard uncertainty.",
                    chart,
                ))
                .table(table),
        )
}

fn csv(residuals: &[PartResidual]) -> CsvTable {
    let texts = |f: fn(&PartResidual) -> String| residuals.iter().map(f).collect::<Vec<_>>();
    let numbers = |f: fn(&PartResidual) -> f64| residuals.iter().map(f).collect::<Vec<_>>();
    CsvTable::new("residuals.csv")
        .texts("part", texts(|r| r.reading.part.clone()))
        .texts("point", texts(|r| r.reading.feature.clone()))
        .texts("axis", texts(|r| r.reading.axis.letter().to_string()))
        .numbers("replicate", numbers(|r| f64::from(r.reading.replicate)))
        .numbers("value_um", numbers(|r| r.reading.value))
        .numbers("predicted_um", numbers(|r| r.predicted))
        .numbers("predicted_std_um", numbers(|r| r.standard_uncertainty))
        .numbers("residual_um", numbers(|r| r.residual))
}
