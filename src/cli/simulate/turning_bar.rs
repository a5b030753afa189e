//! `errsep simulate turning-bar`: a bar that turns while the slide feeds, with known truth.

use errsep_models::noise::Law;
use errsep_models::reversal::turning_bar::simulate::{TurningPlan, simulate};
use errsep_models::reversal::turning_bar::{FEWEST_PER_TURN, FEWEST_READINGS, FEWEST_TURNS};
use serde_json::json;

use super::{few_enough, standard_deviations};
use crate::cli::{Answer, CommonArgs};
use crate::io::{CsvTable, Message};

/// Microradians in a radian, as the options are given.
const URAD_PER_RAD: f64 = 1e6;

/// A bar that turns in the spindle while the slide feeds, one indicator against it.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example: errsep simulate turning-bar --stray 90 --out run
         errsep diagnose run/readings.csv")]
pub struct Args {
    /// Travel, mm.
    #[arg(long, default_value_t = 250.0)]
    length: f64,
    /// Number of readings.
    #[arg(long, default_value_t = 6000)]
    readings: usize,
    /// Turns of the spindle in the run.
    #[arg(long, default_value_t = 60.0)]
    turns: f64,
    /// Its speed, turns a minute.
    #[arg(long, default_value_t = 3.0)]
    rpm: f64,
    /// Slide against spindle axis, with half the cone of the bar, urad.
    #[arg(long, default_value_t = 40.0, allow_negative_numbers = true)]
    slope: f64,
    /// Eccentricity of the bar at mid travel, um.
    #[arg(long, default_value_t = 12.0)]
    eccentricity: f64,
    /// Bar against spindle axis along and across the eccentricity, urad.
    #[arg(long, value_delimiter = ',', num_args = 1, default_values_t = [60.0, 40.0], allow_negative_numbers = true)]
    gamma: Vec<f64>,
    /// Ovality of the bar: half the difference of its diameters, um.
    #[arg(long, default_value_t = 0.3)]
    oval: f64,
    /// Root mean square of the form of slide and bar, um.
    #[arg(long, default_value_t = 4.0)]
    form: f64,
    /// By how much the spindle strays from a steady turn, degrees; 0: it turns steadily.
    #[arg(long, default_value_t = 0.0)]
    stray: f64,
    /// Bend of the bar at mid travel, um.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    bend: f64,
    /// Jump of the indicator's zero at a third of the run, um.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    jump: f64,
    /// Noise of a reading: white part, and part correlated along the run, um.
    #[arg(long, value_delimiter = ',', num_args = 1, default_values_t = [0.1, 0.2])]
    noise: Vec<f64>,
    /// Correlation time of that part, s.
    #[arg(long, default_value_t = 0.8)]
    correlation: f64,
    /// Record the angle of the spindle, column `spindle`.
    #[arg(long)]
    recorded: bool,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Simulates a run.
///
/// # Errors
/// Options that make no run.
pub fn run(args: &Args) -> Result<Answer, Message> {
    few_enough(&[args.readings], "--readings")?;
    let bad = |what: &str, remedy: &str| {
        Err(Message::bad_input(what.to_owned()).remedy(remedy.to_owned()))
    };
    let ([white, correlated], [along, across]) = (&args.noise[..], &args.gamma[..]) else {
        return bad(
            "--noise and --gamma take two figures each",
            "give them as 0.1,0.2",
        );
    };
    standard_deviations(&[
        ("--noise", *white),
        ("--noise", *correlated),
        ("--form", args.form),
    ])?;
    for (option, value) in [
        ("--length", args.length),
        ("--rpm", args.rpm),
        ("--correlation", args.correlation),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return bad(
                &format!("{option} {value} cannot be"),
                "give a number above zero",
            );
        }
    }
    let per_turn = args.readings as f64 / args.turns;
    if !(args.turns >= FEWEST_TURNS && per_turn >= FEWEST_PER_TURN)
        || args.readings < FEWEST_READINGS
    {
        return bad(
            "these readings and turns make no run",
            "give three turns or more and twenty readings a turn",
        );
    }
    let plan = TurningPlan {
        length_mm: args.length,
        readings: args.readings,
        turns: args.turns,
        rpm: args.rpm,
        slope_rad: args.slope / URAD_PER_RAD,
        eccentricity_um: args.eccentricity,
        gamma_rad: [along / URAD_PER_RAD, across / URAD_PER_RAD],
        oval_um: args.oval,
        form_um: args.form,
        stray_rad: args.stray.to_radians(),
        bend_um: args.bend,
        jump_um: args.jump,
        noise: Law {
            white: white * white,
            correlated: correlated * correlated,
            length: args.correlation,
            shift: 0.0,
            drift: 0.0,
        },
        recorded: args.recorded,
        seed: args.common.seed,
    };
    let (readings, truth) = simulate(&plan);
    let column = |of: fn(&errsep_models::reversal::turning_bar::TurningReading) -> f64| {
        readings.iter().map(of).collect::<Vec<f64>>()
    };
    let mut table =
        CsvTable::new("readings.csv").numbers("time", column(|r| r.time.unwrap_or(0.0)));
    if args.recorded {
        table = table.numbers("spindle", column(|r| r.spindle.unwrap_or(0.0)));
    }
    let table = table
        .numbers("x", column(|r| r.x))
        .numbers("reading", column(|r| r.value));
    let known = json!({
        "slope": {"value": plan.slope_rad, "unit": "rad"},
        "eccentricity": {"value": plan.eccentricity_um, "unit": "um"},
        "gamma": {"along": plan.gamma_rad[0], "across": plan.gamma_rad[1], "unit": "rad"},
        "oval": {"value": plan.oval_um, "unit": "um"},
        "bend": {"value": plan.bend_um, "unit": "um"},
        "jump": {"value": plan.jump_um, "unit": "um"},
        "noise": {"white": white, "correlated": correlated, "length": args.correlation, "unit": "um"},
        "lag": {"time": truth.time, "lag": truth.lag_rad, "unit": "rad"},
        "form": {"form": truth.form_um, "unit": "um"},
    });
    super::answer("turning-bar", table, known, args.common.seed)
}
