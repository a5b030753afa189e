//! `errsep simulate machine`: readings of the components of a known machine, and parts made on it.

use std::path::PathBuf;

use errsep_models::machine::{
    Characterization, MachineError, PartDisturbance, amplitude, simulate_characterization,
    simulate_parts_disturbed,
};
use serde_json::json;

use crate::cli::{Answer, CommonArgs};
use crate::io::machine::{read_filed, read_points};
use crate::io::{CsvTable, Message};

/// Most readings that are simulated.
const MOST_READINGS: usize = 10_000_000;

/// Readings of the components of a known machine and, with --points, of parts made on it.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example: errsep simulate machine machine.toml --from 0 --to 177.8 --positions 8 --repeats 10 \\
           --points holes.csv --out simulated")]
pub struct Args {
    /// The machine whose errors are the truth; its standard uncertainties are the scatter.
    #[arg(value_name = "MODEL.toml")]
    model: PathBuf,
    /// First station along every axis, mm.
    #[arg(
        long,
        value_name = "MM",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    from: f64,
    /// Last station, mm.
    #[arg(
        long,
        value_name = "MM",
        default_value_t = 200.0,
        allow_hyphen_values = true
    )]
    to: f64,
    /// Number of stations.
    #[arg(long, alias = "stations", value_name = "N", default_value_t = 8)]
    positions: usize,
    /// Readings at each station.
    #[arg(long, value_name = "N", default_value_t = 10)]
    repeats: usize,
    /// Points of the parts (columns point, x, y and z, mm).
    #[arg(long, value_name = "POINTS.csv")]
    points: Option<PathBuf>,
    /// Number of parts.
    #[arg(long, value_name = "N", default_value_t = 21)]
    parts: usize,
    /// Measurements of each part.
    #[arg(long, value_name = "N", default_value_t = 2)]
    replicates: u32,
    /// Standard deviation of a measurement of a part, um.
    #[arg(long, value_name = "UM", default_value_t = 0.5)]
    noise: f64,
    /// Switch on an effect of the diagnosis's catalogue at a size, in its exact form; may be given
    /// several times. They act on the parts. Sizes are in um, rad or shares; those of part-zero, part-rotation and
    /// part-temperature are standard deviations over the parts.
    #[arg(long = "effect", value_name = "NAME=VALUE")]
    effects: Vec<String>,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    super::standard_deviations(&[("--noise", args.noise)])?;
    let filed = read_filed(&args.model, None)?;
    let machine = &filed.machine;
    let wrong = |error: MachineError| {
        let remedy = "keep the stations and points within the tables of the machine";
        filed.wrong(&error, remedy)
    };
    let points = args
        .points
        .as_deref()
        .map(read_points)
        .transpose()?
        .unwrap_or_default();
    let of_parts = points.len().saturating_mul(2).saturating_mul(args.parts);
    let readings = [
        args.positions
            .saturating_mul(args.repeats)
            .saturating_mul(machine.errors().len()),
        of_parts.saturating_mul(args.replicates as usize),
    ];
    if readings.iter().any(|n| *n > MOST_READINGS) {
        return Err(Message::bad_input("that many readings are not simulated")
            .remedy("give at most ten million readings"));
    }
    if !(args.from.is_finite() && args.to.is_finite()) || args.positions == 0 {
        return Err(Message::bad_input("the stations are not a finite row")
            .remedy("give --from, --to and --positions 1 or more"));
    }
    let step = (args.to - args.from) / args.positions.saturating_sub(1).max(1) as f64;
    let stations = (0..args.positions)
        .map(|i| args.from + step * i as f64)
        .collect();
    let plan = Characterization {
        stations,
        repeats: args.repeats,
    };
    let readings = simulate_characterization(machine, &plan, args.common.seed).map_err(wrong)?;
    let components = CsvTable::new("components.csv")
        .texts(
            "component",
            readings
                .iter()
                .map(|(c, _)| c.to_string())
                .collect::<Vec<_>>(),
        )
        .numbers(
            "position",
            readings.iter().map(|(_, o)| o.position).collect::<Vec<_>>(),
        )
        .numbers(
            "value",
            readings.iter().map(|(_, o)| o.value).collect::<Vec<_>>(),
        );
    let disturbances = super::effects(
        &args.effects,
        &PartDisturbance::NAMES,
        amplitude,
        PartDisturbance::named,
    )?;
    if points.is_empty() && !disturbances.is_empty() {
        return Err(
            Message::bad_input("effects act on parts, and there are none")
                .remedy("give the points of the parts with --points"),
        );
    }
    let mut more = Vec::new();
    if !points.is_empty() {
        let (parts, noise) = (args.parts, args.noise);
        let made = simulate_parts_disturbed(
            machine,
            &points,
            parts,
            args.replicates,
            noise,
            &disturbances,
            args.common.seed,
        )
        .map_err(wrong)?;
        let texts = |f: fn(&errsep_models::machine::PartReading) -> String| {
            made.iter().map(f).collect::<Vec<_>>()
        };
        let numbers = |f: fn(&errsep_models::machine::PartReading) -> f64| {
            made.iter().map(f).collect::<Vec<_>>()
        };
        more.push(
            CsvTable::new("parts.csv")
                .texts("part", texts(|r| r.part.clone()))
                .texts("point", texts(|r| r.feature.clone()))
                .texts(
                    "axis",
                    texts(|r| r.axis.letter().to_lowercase().to_string()),
                )
                .numbers("replicate", numbers(|r| f64::from(r.replicate)))
                .numbers("value", numbers(|r| r.value)),
        );
    }
    more.iter().try_for_each(super::finite)?;
    let known = json!({
        "machine": args.model.display().to_string(),
        "chain": machine.chain().to_string(),
        "noise_of_parts": {"std": args.noise, "unit": "um"},
        "effects": args.effects,
    });
    let mut answer = super::answer("machine", components, known, args.common.seed)?;
    answer.tables.extend(more);
    answer.inputs = [Some(&args.model), args.points.as_ref()]
        .into_iter()
        .flatten()
        .cloned()
        .collect();
    Ok(answer)
}
