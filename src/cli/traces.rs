//! `errsep traces`: traces at two opposite spindle angles from a run with a turning artefact.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use errsep_models::reversal::turning::{NoTraces, Sample, Turning, find_turning, traces};
use errsep_models::reversal::{Direction, Observations};
use serde_json::json;

use super::{Answer, ColumnArgs, CommonArgs};
use crate::io::{ColumnMap, CsvTable, Message, Status, TableReader};
use crate::report::number::{measured, plain};
use crate::report::plot::{Axis, Chart, Series};
use crate::report::{Figure, KeyFigure, Page, Section, Standing};

/// Traces for `errsep reversal` from one indicator on an artefact that turns while the slide feeds.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
RUN.csv has the columns time (s), x (mm) and reading (um). The once-per-turn wave of the readings
tells the spindle angle. Each passage of the angle gives a reading of channel 1A, each passage of
the opposite angle one of 2B; --out DIR writes them as DIR/traces.csv.

Example:
    errsep traces run.csv --columns time=t_s,x=z_mm:mm,reading=reading_mm:mm --out traces
    errsep reversal traces/traces.csv")]
pub struct Args {
    /// The run.
    #[arg(value_name = "RUN.csv")]
    run: PathBuf,
    #[command(flatten)]
    columns: ColumnArgs,
    /// Spindle angle of channel 1A, degrees after the highest reading of the once-per-turn wave.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    angle: f64,
    /// Samples within this many degrees on either side of an angle make one reading.
    #[arg(long, value_name = "DEG", default_value_t = 20.0)]
    window: f64,
    /// About how fast the spindle turns, in turns a minute; absent: found in the readings.
    #[arg(long)]
    rpm: Option<f64>,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Takes traces at two opposite spindle angles.
///
/// # Errors
/// The file is no run of a turning artefact.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let option = |ok: bool, what: &str, remedy: &str| {
        if ok {
            Ok(())
        } else {
            Err(Message::bad_input(what).remedy(remedy))
        }
    };
    option(
        args.angle.is_finite(),
        "--angle is not finite",
        "give degrees",
    )?;
    option(
        args.window > 0.0 && args.window <= 60.0,
        "--window is not between 0 and 60 degrees",
        "20 is usual",
    )?;
    option(
        args.rpm.is_none_or(|r| r.is_finite() && r > 0.0),
        "--rpm is not a speed",
        "give turns a minute",
    )?;
    let samples = read(&args.run, &args.columns.map())?;
    let refuse = |why: NoTraces| {
        Message::bad_input(why.to_string())
            .in_file(&args.run)
            .remedy(match args.rpm {
                Some(_) => "give --rpm as about the speed of the spindle in this run, or leave it out: it is found in the readings",
                None => "give a run in one direction in which the spindle turns steadily, and --rpm if its speed is known",
            })
    };
    let turning = find_turning(&samples, args.rpm.map(|r| r / 60.0)).map_err(refuse)?;
    let data = traces(
        &samples,
        &turning,
        args.angle.to_radians(),
        args.window.to_radians(),
    )
    .map_err(refuse)?;
    Ok(answer(args, samples.len(), &turning, &data))
}

fn read(path: &Path, map: &ColumnMap) -> Result<Vec<Sample>, Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&["time", "x", "reading"])?;
    let time = table.column("time")?.in_s();
    let (x, reading) = (table.column("x")?.in_mm(), table.column("reading")?.in_um());
    let mut samples: Vec<Sample> = Vec::new();
    while let Some(row) = table.next_row()? {
        let sample = Sample {
            time: row.number(&time)?,
            x: row.number(&x)?,
            value: row.number(&reading)?,
        };
        if samples.last().is_some_and(|last| sample.time <= last.time) {
            return Err(row.error(&time, "time does not grow").remedy(
                "write the samples in the order in which they were taken, each time once",
            ));
        }
        samples.push(sample);
    }
    if samples.is_empty() {
        return Err(table.no_rows());
    }
    Ok(samples)
}

fn answer(args: &Args, samples: usize, turning: &Turning, data: &Observations) -> Answer {
    let count = |name: &str| {
        data.readings
            .iter()
            .filter(|r| r.channel.name() == name)
            .count()
    };
    let (near, far) = (count("1A"), count("2B"));
    let rpm = (turning.frequency * 60.0, turning.frequency_std() * 60.0);
    let degrees = plain(turning.angle_std_rad.to_degrees(), 2);
    let angle = if turning.tells_angle() {
        format!("spindle angle known to {degrees}°")
    } else {
        format!(
            "the spindle angle is not told: the spindle strays by about {degrees}° from the wave, so that 1A and 2B stay half a turn apart but see other sides along the bar; `errsep diagnose` follows such a turn"
        )
    };
    let travel = (data.readings.iter().map(|r| r.x))
        .fold((f64::MAX, f64::MIN), |(low, high), x| {
            (low.min(x), high.max(x))
        });
    let slope = turning.slope_std(args.angle.to_radians(), travel.1 - travel.0);
    let mut text = String::new();
    let _ = write!(
        text,
        "{}: {samples} samples over {:.1} turns at {} turns a minute\n\
         Once-per-turn wave: amplitude {} µm in the middle of the run; {}\n\
         Left by background, wave and second harmonic: {} µm rms\n\
         {near} readings at {}° (1A) and {far} half a turn later (2B)\n\
         Oval of the section: {} µm; as far as the spindle angle is open it tilts both traces by {} µrad (standard uncertainty), which no scatter of them \
         shows: add it to u of alpha, or take the whole run at once with errsep diagnose\n",
        args.run.display(),
        turning.turns,
        measured(rpm.0, Some(rpm.1)),
        plain(turning.amplitude, 4),
        angle,
        plain(turning.rest_rms, 3),
        args.angle,
        plain(turning.oval.norm(), 2),
        plain(1e6 * slope, 2),
    );
    let of = |f: fn(&errsep_models::reversal::Reading) -> f64| {
        data.readings.iter().map(f).collect::<Vec<_>>()
    };
    let names = |f: fn(&errsep_models::reversal::Reading) -> &'static str| {
        data.readings
            .iter()
            .map(|r| f(r).to_owned())
            .collect::<Vec<_>>()
    };
    let table = CsvTable::new("traces.csv")
        .texts("channel", names(|r| r.channel.name()))
        .texts(
            "direction",
            names(|r| match r.direction {
                Direction::Forward => "forward",
                Direction::Backward => "backward",
            }),
        )
        .numbers("time", of(|r| r.time.unwrap_or(0.0)))
        .numbers("x", of(|r| r.x))
        .numbers("reading", of(|r| r.value));
    Answer {
        text,
        json: json!({
            "schema": "errsep.traces/1",
            "samples": samples,
            "turns": turning.turns,
            "frequency": {"value": turning.frequency, "std": turning.frequency_std(), "unit": "Hz"},
            "amplitude": {"value": turning.amplitude, "unit": "um"},
            "angle": {"value": args.angle.to_radians(), "std": turning.tells_angle().then_some(turning.angle_std_rad), "unit": "rad"},
            "rest": {"rms": turning.rest_rms, "unit": "um"},
            "oval": {"value": turning.oval.norm(), "unit": "um"},
            "slope": {"std": slope, "unit": "rad"},
            "readings": {"1A": near, "2B": far},
        }),
        page: page(args, turning, data),
        tables: vec![table],
        inputs: vec![args.run.clone()],
        setup: None,
        seed: None,
        status: Status::Done,
    }
}

fn page(args: &Args, turning: &Turning, data: &Observations) -> Page {
    let chart = data.channels().into_iter().fold(
        Chart::new(
            Axis::new("slide position x", "mm"),
            Axis::new("reading", "µm"),
        ),
        |chart, channel| {
            let of = |f: fn(&errsep_models::reversal::Reading) -> f64| {
                data.of(channel).map(f).collect::<Vec<_>>()
            };
            chart.series(Series::line(channel.name(), of(|r| r.x), of(|r| r.value)))
        },
    );
    let sentence = format!(
        "Traces at two opposite spindle angles, from {} turns at {} turns/min; what wave and form leave is {} µm RMS.",
        plain(turning.turns, 3),
        plain(turning.frequency * 60.0, 4),
        plain(turning.rest_rms, 3)
    );
    Page::new("Traces of a turning artefact", args.run.display().to_string())
        .summary(Standing::Neutral, sentence)
        .section(
        Section::new("Two opposite spindle angles")
            .key_figures([
                KeyFigure::new("Speed", turning.frequency * 60.0, "turns/min")
                    .std(turning.frequency_std() * 60.0),
                KeyFigure::new("Once-per-turn amplitude", turning.amplitude, "µm")
                    .meaning("in the middle of the run"),
            ])
            .figure(Figure::new(
                "Traces",
                "One reading at each passage of the spindle angle (1A) and of the opposite one (2B).",
                chart,
            )),
    )
}
