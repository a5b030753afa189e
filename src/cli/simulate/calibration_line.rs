//! `errsep simulate calibration-line`.

use errsep_models::calibration_line::amplitude;
use errsep_models::calibration_line::simulate::{CalibrationSimulation, Disturbance, simulate};
use serde_json::json;

use crate::cli::{Answer, CommonArgs};
use crate::io::{CsvTable, Message};

/// Readings of a transducer against a straight line, in one or several sets.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example: errsep simulate calibration-line --repeats 3 --effect quadratic=0.02 > readings.csv")]
pub struct Args {
    /// Reading at zero load.
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "Y",
        allow_negative_numbers = true
    )]
    intercept: f64,
    /// Reading per load.
    #[arg(
        long,
        default_value_t = 1.0,
        value_name = "Y/X",
        allow_negative_numbers = true
    )]
    slope: f64,
    /// Greatest load.
    #[arg(long, default_value_t = 10.0, value_name = "X")]
    full_scale: f64,
    /// Loads of a set, even steps up to full scale.
    #[arg(long, alias = "loads", default_value_t = 20, value_name = "N")]
    positions: usize,
    /// Sets.
    #[arg(long, alias = "sets", default_value_t = 2, value_name = "N")]
    repeats: u32,
    /// Go back through the same loads in each set
    #[arg(long)]
    both_directions: bool,
    /// Standard deviation of a reading.
    #[arg(long, default_value_t = 1e-3, value_name = "Y")]
    noise: f64,
    /// Switch on an effect of the diagnosis's catalogue at a size, in its exact form; may be given
    /// several times. Sizes are in the unit of the reading.
    #[arg(long = "effect", value_name = "NAME=VALUE")]
    effects: Vec<String>,
    #[command(flatten)]
    pub(in crate::cli) common: CommonArgs,
}

/// Makes the readings.
///
/// # Errors
/// Figures that make no calibration, an unknown effect.
pub fn run(args: &Args) -> Result<Answer, Message> {
    super::few_enough(
        &[args.positions, args.repeats as usize],
        "--positions or --repeats",
    )?;
    super::standard_deviations(&[("--noise", args.noise)])?;
    let sizes = [args.intercept, args.slope, args.full_scale];
    if args.positions == 0 || args.repeats == 0 || sizes.iter().any(|s| !s.is_finite()) {
        return Err(Message::bad_input("these figures make no calibration")
            .remedy("give one or more --positions and --repeats, and finite sizes"));
    }
    if args.full_scale <= 0.0 {
        return Err(
            Message::bad_input(format!("a full scale of {} is no load", args.full_scale))
                .remedy("give --full-scale a number greater than zero"),
        );
    }
    let disturbances = super::effects(
        &args.effects,
        &Disturbance::NAMES,
        amplitude,
        |name, size| Disturbance::named(name, size, args.repeats),
    )?;
    let what = CalibrationSimulation {
        line: [args.intercept, args.slope],
        full_scale: args.full_scale,
        loads: args.positions,
        sets: args.repeats,
        both_directions: args.both_directions,
        noise: args.noise,
        disturbances,
    };
    let seed = args.common.seed;
    let readings = simulate(&what, seed)
        .map_err(|e| Message::bad_input(e.to_string()).remedy("give --noise a finite number"))?;
    let table = CsvTable::new("readings.csv")
        .numbers("x", readings.iter().map(|r| r.x).collect::<Vec<_>>())
        .numbers("y", readings.iter().map(|r| r.y).collect::<Vec<_>>())
        .numbers(
            "set",
            readings
                .iter()
                .map(|r| f64::from(r.set))
                .collect::<Vec<_>>(),
        )
        .numbers(
            "time",
            readings
                .iter()
                .map(|r| r.time.unwrap_or(f64::NAN))
                .collect::<Vec<_>>(),
        );
    super::answer(
        "calibration-line",
        table,
        json!({
            "intercept": args.intercept,
            "slope": args.slope,
            "noise": args.noise,
            "effects": args.effects,
        }),
        seed,
    )
}
