//! Length, squareness and circularity.

use std::path::{Path, PathBuf};

use errsep_models::machine::features::{self, Circle, Squareness};
use errsep_models::machine::{Axis, MachineError, Position, Sampler, propagate, sample_features};
use errsep_models::uncertainty::Sample;
use nalgebra::Vector3;

use super::result::{Outcome, answer};
use super::{Context, PropagationArgs};
use crate::cli::{Answer, CommonArgs};
use crate::io::Message;
use crate::io::machine::read_points;
use crate::report::number;

/// Greatest number of trials: their results are kept.
const MOST_TRIALS: usize = 20_000_000;

/// Greatest number of points of a circle.
const MOST_POINTS: usize = 100_000;

/// Errors of lengths between points.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: errsep machine machine.toml length holes.csv --between 3:9 --between 9:15"
)]
pub(super) struct LengthArgs {
    /// The points (columns point, x, y and z, mm).
    #[arg(value_name = "POINTS.csv")]
    points: PathBuf,
    /// Two points; may be given many times.
    #[arg(long, value_name = "FROM:TO", required = true)]
    between: Vec<String>,
    /// Trials of a simulation beside the propagation; none if 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    trials: usize,
    #[command(flatten)]
    pub(super) propagation: PropagationArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// The angle between two rows of points.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example: errsep machine machine.toml squareness holes.csv --first 3,26,25,24,23,22,21 \\
           --second 3,4,5,6,7,8,9")]
pub(super) struct SquarenessArgs {
    /// The points (columns point, x, y and z, mm).
    #[arg(value_name = "POINTS.csv")]
    points: PathBuf,
    /// Points of the first row.
    #[arg(long, value_name = "POINT,…", value_delimiter = ',', required = true)]
    first: Vec<String>,
    /// Points of the second row.
    #[arg(long, value_name = "POINT,…", value_delimiter = ',', required = true)]
    second: Vec<String>,
    /// Directions along which the rows run.
    #[arg(long, value_name = "AXES", default_value = "XY", value_parser = two_axes)]
    along: [Axis; 2],
    /// Trials of a simulation beside the propagation; none if 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    trials: usize,
    #[command(flatten)]
    pub(super) propagation: PropagationArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Circularity of a circle cut by the machine, from its circle of least squares.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: errsep machine machine.toml circularity --centre 75,75 --radius 44.5"
)]
pub(super) struct CircularityArgs {
    /// Centre, mm: two coordinates, or three.
    #[arg(long, value_name = "X,Y[,Z]", value_parser = centre, allow_hyphen_values = true)]
    centre: Position,
    /// Radius, mm.
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    radius: f64,
    /// Number of points, equally spaced.
    #[arg(long, value_name = "N", default_value_t = 36)]
    count: usize,
    /// Plane of the circle.
    #[arg(long, value_name = "AXES", default_value = "XY", value_parser = two_axes)]
    plane: [Axis; 2],
    /// Trials of the simulation.
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    trials: usize,
    #[command(flatten)]
    pub(super) propagation: PropagationArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

fn two_axes(text: &str) -> Result<[Axis; 2], String> {
    let axis = |letter| Axis::ALL.into_iter().find(|a| Some(a.letter()) == letter);
    let mut letters = text.chars();
    match (axis(letters.next()), axis(letters.next()), letters.next()) {
        (Some(a), Some(b), None) if a != b => Ok([a, b]),
        _ => Err("write two different axes, such as XY".to_owned()),
    }
}

fn centre(text: &str) -> Result<Position, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse::<f64>().ok().filter(|v| v.is_finite()))
        .collect::<Option<_>>()
        .ok_or("write numbers with a decimal point, separated by commas")?;
    match numbers[..] {
        [x, y] => Ok(Position::new(x, y, 0.0)),
        [x, y, z] => Ok(Position::new(x, y, z)),
        _ => Err("write two or three coordinates".to_owned()),
    }
}

/// A point by its name.
fn named(points: &[(String, Position)], name: &str, file: &Path) -> Result<Position, Message> {
    points
        .iter()
        .find(|(n, _)| n == name)
        .map(|(_, p)| *p)
        .ok_or_else(|| {
            let near = crate::io::message::nearest(name, points.iter().map(|(n, _)| n.as_str()));
            let remedy = match near {
                Some(near) => format!("did you mean `{near}`?"),
                None => "name a point of the file".to_owned(),
            };
            Message::bad_input(format!("there is no point `{name}`"))
                .in_file(file)
                .remedy(remedy)
        })
}

pub(super) fn length(context: &Context, args: &LengthArgs) -> Result<Answer, Message> {
    let points = read_points(&args.points)?;
    let mut outcomes = Vec::new();
    for pair in &args.between {
        let (from, to) = pair.split_once(':').ok_or_else(|| {
            Message::bad_input(format!("--between {pair} does not name two points"))
                .remedy("write the two points with a colon between, such as 3:9")
        })?;
        let a = named(&points, from, &args.points)?;
        let b = named(&points, to, &args.points)?;
        let wrong = |error: MachineError| context.wrong(&error);
        let functional = match features::length(context.machine, &a, &b) {
            Err(error @ MachineError::BadFeature { .. }) => {
                return Err(Message::bad_input(format!("--between {pair}: {error}"))
                    .in_file(&args.points)
                    .remedy("name two points at different places"));
            }
            other => other.map_err(wrong)?,
        };
        let p = context.propagation;
        let budget = propagate(
            context.machine,
            &functional,
            p.independence(),
            p.prediction(),
        );
        let sample = simulated(
            context,
            args.trials,
            args.common.seed,
            &[a, b],
            |d| match d {
                [start, end] => features::length_of(&(b - a), &(end - start)),
                _ => f64::NAN,
            },
        )?;
        outcomes.push(Outcome {
            label: format!("length {from} to {to}"),
            nominal: format!(", nominal {} mm", number::plain((b - a).norm(), 7)),
            budget: Some(budget.map_err(wrong)?),
            sample,
            certain: None,
            unit: "um",
        });
    }
    answer(
        context,
        "length",
        &outcomes,
        Some(&args.points),
        seed(args.trials, &args.common),
    )
}

pub(super) fn squareness(context: &Context, args: &SquarenessArgs) -> Result<Answer, Message> {
    let points = read_points(&args.points)?;
    let row = |names: &[String]| {
        names
            .iter()
            .map(|n| named(&points, n.trim(), &args.points))
            .collect::<Result<Vec<_>, _>>()
    };
    let wrong = |error: MachineError| context.wrong(&error);
    let rows =
        Squareness::new(args.along, row(&args.first)?, row(&args.second)?).map_err(|error| {
            Message::bad_input(error.to_string())
                .in_file(&args.points)
                .remedy("name two or more points a row, and their direction by --along")
        })?;
    let functional = rows.functional(context.machine).map_err(wrong)?;
    let p = context.propagation;
    let budget = propagate(
        context.machine,
        &functional,
        p.independence(),
        p.prediction(),
    );
    let sample = simulated(
        context,
        args.trials,
        args.common.seed,
        &rows.points(),
        |d| rows.angle(d),
    )?;
    let outcome = Outcome {
        label: "squareness".into(),
        nominal: ", positive where the angle exceeds 90°".into(),
        budget: Some(budget.map_err(wrong)?),
        sample,
        certain: None,
        unit: "rad",
    };
    answer(
        context,
        "squareness",
        &[outcome],
        Some(&args.points),
        seed(args.trials, &args.common),
    )
}

pub(super) fn circularity(context: &Context, args: &CircularityArgs) -> Result<Answer, Message> {
    let wrong = |error: MachineError| context.wrong(&error);
    if args.count > MOST_POINTS {
        return Err(
            Message::bad_input(format!("--count {} points are too many", args.count))
                .remedy(format!("give at most {MOST_POINTS}; 36 are usual")),
        );
    }
    let circle =
        Circle::new(args.plane, args.centre, args.radius, args.count).map_err(|error| {
            Message::bad_input(error.to_string()).remedy("correct --radius, --count or --plane")
        })?;
    if args.trials < 2 {
        return Err(
            Message::bad_input("a circularity has an uncertainty by simulation only")
                .remedy("give --trials 2 or more"),
        );
    }
    let points = circle.points();
    let mean = points
        .iter()
        .map(|p| context.machine.deviation(p))
        .collect::<Result<Vec<_>, _>>()
        .map_err(wrong)?;
    let sample = simulated(context, args.trials, args.common.seed, points, |d| {
        features::circularity_of(&circle, d)
    })?;
    let outcome = Outcome {
        label: "circularity".into(),
        nominal: format!(
            ", radius {} mm, {} points",
            number::plain(args.radius, 6),
            points.len()
        ),
        budget: None,
        sample,
        certain: Some(features::circularity_of(&circle, &mean)),
        unit: "um",
    };
    answer(
        context,
        "circularity",
        &[outcome],
        None,
        seed(args.trials, &args.common),
    )
}

fn seed(trials: usize, common: &CommonArgs) -> Option<u64> {
    (trials > 0).then_some(common.seed)
}

/// The simulated distribution of one number; `None` for no trials.
fn simulated(
    context: &Context,
    trials: usize,
    seed: u64,
    points: &[Position],
    feature: impl Fn(&[Vector3<f64>]) -> f64 + Sync,
) -> Result<Option<Sample>, Message> {
    if trials == 0 {
        return Ok(None);
    }
    if trials > MOST_TRIALS {
        return Err(
            Message::bad_input(format!("--trials {trials} would not fit into memory")).remedy(
                format!("give at most {MOST_TRIALS}; 100000 settle two digits"),
            ),
        );
    }
    let wrong = |error: MachineError| context.wrong(&error);
    let p = context.propagation;
    let sampler = Sampler::new(context.machine, points, p.independence(), p.prediction());
    let result = sample_features(&sampler.map_err(wrong)?, trials, 1, seed, |d, out| {
        out[0] = feature(d)
    });
    Ok(result.map_err(wrong)?.output(0))
}
