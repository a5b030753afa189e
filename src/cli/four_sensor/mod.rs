//! `errsep four-sensor`: surface, straightness and tilt from four sensors.

mod gather;
mod json;
mod page;
pub(super) mod read;
mod separate;
pub(super) mod setup;
mod words;

use std::path::PathBuf;

use errsep_models::four_sensor::{
    Choice, Ends, FourSensorError, Likeliest, MinimumZone, Parabola, PublishedSeparation,
    Separation,
};
use errsep_models::uncertainty::{DegreesOfFreedom, Disagreement};

use super::diagnose::joined::{self, Given};
use super::{Answer, ColumnArgs, CommonArgs};
use crate::io::{CsvTable, Message, SetupFile, Status};
use read::Measured;
use separate::{Separated, Task};
use setup::Setup;

/// Straightness and tilt of a slide from four displacement sensors on one surface.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The file has one row a slide position with the outputs of the four sensors in um,

    x,m1,m2,m3,m4
    0,1.25,-0.31,2.07,11.48

or one row a reading (sensor,x,reading); a column `repeat` numbers repeats, whose outputs are averaged
before they are separated, so that lambda is chosen for the average. The set-up gives the distance of
each sensor to the one before and, if known, the noise of one reading:

    [sensors]
    spacing = [5.0, 5.0, 25.0]   # mm, multiples of the step
    noise = 0.1                  # um, of one reading of one repeat
    [separation]                 # all optional
    penalty = \"curvature\"        # or profile, slope, profile-from-ends; absent: the likeliest of the first three
    choice = \"l-curve\"           # or likelihood, gcv, discrepancy; or lambda = 0.02
    line = \"end-points\"          # or least-squares: what surface and straightness are counted from
    [parabola]                   # optional, one of
    tilt_slope = 1e-8            # rad/mm; surface_curvature, um/mm2; zero_adjustment, um

Example: errsep four-sensor data.csv --setup setup.toml --out four-sensor")]
pub struct Args {
    /// The outputs.
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// The set-up.
    #[arg(long, value_name = "SETUP.toml")]
    setup: PathBuf,
    /// Fit these effects along with the model, by the names of `errsep diagnose`: the answer is given without
    /// and with them, with one covariance.
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',')]
    with: Vec<String>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// The most points of surface for which the system is decomposed whole; longer records go through
/// the band, where the published way has no place.
const LONGEST_DENSE: usize = 400;

/// What the answer is written from.
struct Found {
    measured: Measured,
    setup: Setup,
    noise_stated: bool,
    /// Where the set-up does not name the penalty.
    likeliest: Option<Likeliest>,
    separation: Separation,
    straightness_error: MinimumZone,
    published: Option<PublishedSeparation>,
    /// Condition number of the system that was solved, where it was decomposed.
    condition_number: Option<f64>,
    /// Where the penalty is on the profile and the system was decomposed.
    ends: Option<Ends>,
}

impl Found {
    /// Whether the noise is that of the scatter of the repeats.
    fn noise_from_repeats(&self) -> bool {
        !self.noise_stated && !self.separation.noise_estimated
    }

    /// As [`Self::degrees_of_freedom`], infinite where there are none to tell.
    fn coverage_degrees(&self) -> DegreesOfFreedom {
        self.degrees_of_freedom()
            .unwrap_or(DegreesOfFreedom::Infinite)
    }

    /// Whether the answer rests on the assumption that the surface has no parabola.
    fn parabola_is_open(&self) -> bool {
        self.setup.settings.parabola == Parabola::LeastNorm
    }

    /// Where the residuals refute a noise that was found apart from them.
    fn disagreement(&self) -> Option<Disagreement> {
        let found = &self.separation;
        // Four outputs a slide position less its S and gamma.
        let rows = 2 * self.measured.outputs.readings().len();
        let degrees = noise_known(found, self.noise_stated, &self.measured)?;
        let test = || found.chosen.disagreement(rows, found.noise, degrees);
        (!found.noise_estimated).then(test).flatten()
    }

    /// How well the noise is known.
    fn degrees_of_freedom(&self) -> Option<DegreesOfFreedom> {
        how_well_known(&self.separation, self.noise_stated, &self.measured)
    }
}

/// Degrees of freedom of the noise: of what the repeats scatter by beyond it, of the scatter of the repeats where it was taken from there.
fn how_well_known(
    found: &Separation,
    noise_stated: bool,
    measured: &Measured,
) -> Option<DegreesOfFreedom> {
    found.excess.map_or_else(
        || noise_known(found, noise_stated, measured),
        |excess| Some(excess.degrees),
    )
}

/// The same of the noise of a reading alone.
fn noise_known(
    found: &Separation,
    noise_stated: bool,
    measured: &Measured,
) -> Option<DegreesOfFreedom> {
    if noise_stated || found.noise_estimated {
        return found.degrees_of_freedom;
    }
    DegreesOfFreedom::new(measured.freedom as f64).ok()
}

/// Separates the outputs.
///
/// # Errors
/// The files are no outputs and set-up of four sensors, or the outputs cannot be separated.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let mut setup = Setup::read(SetupFile::read(&args.setup)?)?;
    let measured = read::read(&args.data, &args.columns.map(), &setup)?;
    let noise_stated = setup.settings.noise.is_some();
    let of_mean = |noise: f64| noise / (measured.repeats as f64).sqrt();
    setup.settings.noise = setup.settings.noise.map(of_mean).or(measured.noise);
    if let Choice::Discrepancy { noise } = &mut setup.settings.choice {
        *noise = of_mean(*noise);
    }
    let dense = measured.outputs.geometry().point_count() <= LONGEST_DENSE;
    let unsolved =
        |error: FourSensorError| Message::not_determined(error.to_string()).in_file(&args.data);
    let likeliest = match setup.penalty_stated {
        true => None,
        false => Likeliest::of(&measured.outputs, dense).map_err(unsolved)?,
    };
    if let Some(likeliest) = &likeliest {
        setup.penalised = likeliest.penalised;
    }
    let task = Task {
        setup: &setup,
        measured: &measured,
        noise_stated,
    };
    let separated = if dense { task.whole() } else { task.long() };
    let Separated {
        separation,
        straightness_error,
        published,
        condition_number,
        ends,
    } = separated.map_err(unsolved)?;
    let found = Found {
        published,
        condition_number,
        ends,
        separation,
        straightness_error,
        noise_stated,
        measured,
        likeliest,
        setup,
    };
    let answer = Answer {
        text: words::text(&found, &args.data)?,
        json: json::json(&found)?,
        page: page::page(&found, &args.data)?,
        tables: tables(&found),
        setup: None,
        inputs: vec![args.data.clone(), args.setup.clone()],
        seed: None,
        status: Status::Done,
    };
    joined::beside(
        answer,
        &Given {
            setup: Some(&args.setup),
            columns: args.columns.clone(),
            ..Given::to("four-sensor", &args.data, &args.with, &args.common)
        },
    )
}

fn tables(found: &Found) -> Vec<CsvTable> {
    let values = |v: &nalgebra::DVector<f64>| v.as_slice().to_vec();
    let Separation {
        surface,
        straightness,
        tilt,
        ..
    } = &found.separation;
    let outputs = &found.measured.outputs;
    let residuals = (0..4).fold(
        CsvTable::new("residuals.csv").numbers("x_mm", outputs.slide_positions()),
        |table, sensor| {
            let column: Vec<f64> = found
                .separation
                .residuals
                .iter()
                .map(|row| row[sensor])
                .collect();
            table.numbers(format!("m{}_um", sensor + 1), column)
        },
    );
    let curve = &found.separation.chosen.curve.points;
    let column = |value: fn(&errsep_solvers::regularization::Point) -> f64| -> Vec<f64> {
        curve.iter().map(value).collect()
    };
    vec![
        CsvTable::new("surface.csv")
            .numbers("x_mm", outputs.surface_positions())
            .numbers("f_um", values(&surface.values))
            .numbers("f_std_um", values(&surface.std))
            .numbers("f_bias_um", values(&surface.bias)),
        CsvTable::new("slide.csv")
            .numbers("x_mm", outputs.slide_positions())
            .numbers("S_um", values(&straightness.values))
            .numbers("S_std_um", values(&straightness.std))
            .numbers("S_bias_um", values(&straightness.bias))
            .numbers("gamma_rad", values(&tilt.values))
            .numbers("gamma_std_rad", values(&tilt.std))
            .numbers("gamma_bias_rad", values(&tilt.bias)),
        residuals,
        CsvTable::new("l_curve.csv")
            .numbers("lambda", column(|p| p.lambda))
            .numbers("residual_norm_um", column(|p| p.residual_norm))
            .numbers("seminorm_um", column(|p| p.seminorm))
            .numbers("curvature", column(|p| p.curvature())),
    ]
}
