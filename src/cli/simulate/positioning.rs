//! `errsep simulate positioning`.

use clap::ValueEnum;
use errsep_models::positioning::{Direction, Figure, PositioningSimulation, Truth, simulate};
use serde_json::{Map, Value, json};

use crate::cli::{Answer, CommonArgs};
use crate::io::positioning::AxisKind;
use crate::io::units::{ARCSEC_PER_DEG, UM_PER_MM};
use crate::io::{CsvTable, Message};

/// Kind of the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum KindName {
    /// Positions in mm, deviations in um.
    Linear,
    /// Positions in degrees, deviations in seconds of arc.
    Rotary,
}

/// A positioning test of an axis: each run forward and back over evenly spaced targets.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Positions are in mm and deviations in um, of a rotary axis in degrees and seconds of arc. Printed are the
readings with the set-up as a comment; --out writes readings.csv and setup.toml.

Example: errsep simulate positioning --lost-motion 4 --noise 0.3 > readings.csv")]
pub struct Args {
    /// Kind of the axis.
    #[arg(long, value_enum, default_value_t = KindName::Linear)]
    kind: KindName,
    /// Name of the axis.
    #[arg(long, default_value = "X")]
    name: String,
    /// First target, mm (degrees).
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "POS",
        allow_negative_numbers = true
    )]
    from: f64,
    /// Last target, mm (degrees).
    #[arg(
        long,
        default_value_t = 500.0,
        value_name = "POS",
        allow_negative_numbers = true
    )]
    to: f64,
    /// Number of targets.
    #[arg(long, alias = "targets", default_value_t = 11, value_name = "N")]
    positions: usize,
    /// Runs.
    #[arg(long, alias = "runs", default_value_t = 5, value_name = "N")]
    repeats: u32,
    /// Deviation gained from the first to the last target, um (arcsec).
    #[arg(
        long,
        default_value_t = 8.0,
        value_name = "UM",
        allow_negative_numbers = true
    )]
    gain: f64,
    /// Amplitude of a deviation that repeats, um (arcsec).
    #[arg(
        long,
        default_value_t = 2.0,
        value_name = "UM",
        allow_negative_numbers = true
    )]
    periodic: f64,
    /// Its period, mm (degrees).
    #[arg(long, default_value_t = 170.0, value_name = "POS")]
    period: f64,
    /// Lost motion: forward approaches stop this much short of backward ones, um (arcsec).
    #[arg(
        long,
        default_value_t = 3.0,
        value_name = "UM",
        allow_negative_numbers = true
    )]
    lost_motion: f64,
    /// Standard deviation of a reading, um (arcsec).
    #[arg(long, default_value_t = 0.5, value_name = "UM")]
    noise: f64,
    /// Drift in an hour, um (arcsec).
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "UM",
        allow_negative_numbers = true
    )]
    drift: f64,
    /// Seconds from one reading to the next.
    #[arg(long, default_value_t = 10.0, value_name = "S")]
    interval: f64,
    #[command(flatten)]
    pub(in crate::cli) common: CommonArgs,
}

/// Makes the readings.
///
/// # Errors
/// Fewer than two targets, no run, a travel or period without length, a noise below zero.
pub fn run(args: &Args) -> Result<Answer, Message> {
    super::few_enough(
        &[args.positions, args.repeats as usize, 2],
        "--positions or --repeats",
    )?;
    super::standard_deviations(&[("--noise", args.noise), ("--interval", args.interval)])?;
    if args.positions < 2 || args.repeats == 0 {
        return Err(Message::bad_input("a test needs two targets and a run")
            .remedy("give --positions 2 or more and --repeats 1 or more"));
    }
    let sizes = [args.gain, args.periodic, args.lost_motion, args.drift];
    let finite = sizes.iter().all(|v| v.is_finite()) && (args.to - args.from).is_finite();
    if !(finite && args.from < args.to && args.period > 0.0) {
        return Err(Message::bad_input("these sizes make no axis")
            .remedy("give --from less than --to, a --period greater than zero and finite sizes"));
    }
    let what = PositioningSimulation {
        from: args.from,
        to: args.to,
        targets: args.positions,
        runs: args.repeats,
        gain: args.gain,
        periodic: args.periodic,
        period: args.period,
        lost_motion: args.lost_motion,
        noise: args.noise,
        drift: args.drift,
        interval: args.interval,
    };
    let seed = args.common.seed;
    let readings = simulate(&what, seed).map_err(|e| {
        Message::bad_input(e.to_string()).remedy("give --noise a number not below zero")
    })?;
    let (kind, scale) = match args.kind {
        KindName::Linear => (AxisKind::Linear, UM_PER_MM),
        KindName::Rotary => (AxisKind::Rotary, ARCSEC_PER_DEG),
    };
    let numbers = |of: &dyn Fn(usize) -> f64| (0..readings.len()).map(of).collect::<Vec<_>>();
    let table = CsvTable::new("readings.csv")
        .numbers("target", numbers(&|i| readings[i].target))
        .numbers("run", numbers(&|i| f64::from(readings[i].run)))
        .words(
            "direction",
            Direction::ALL.map(Direction::name),
            readings
                .iter()
                .map(|r| r.direction.index() as u8)
                .collect::<Vec<_>>(),
        )
        .numbers(
            "position",
            numbers(&|i| readings[i].target + readings[i].deviation / scale),
        )
        .numbers("time", numbers(&|i| readings[i].time.unwrap_or(f64::NAN)));
    let mut answer = super::answer(
        "positioning",
        table,
        truth(&what, &what.truth(), kind),
        seed,
    )?;
    let name = toml::Value::from(args.name.as_str());
    let setup = format!(
        "[axis]\nname = {name}\nkind = \"{}\"\ntravel_from = {:?}\ntravel_to = {:?}\n",
        kind.name(),
        args.from,
        args.to
    );
    super::add_setup(&mut answer, setup, "axis", 0.0);
    Ok(answer)
}

fn truth(what: &PositioningSimulation, truth: &Truth, kind: AxisKind) -> Value {
    let unit = kind.deviation_unit();
    let figures: Map<String, Value> = Figure::all()
        .filter_map(|f| Some((f, truth.values.get(f)?)))
        .map(|(f, value)| (f.key().to_owned(), json!({"value": value, "unit": unit})))
        .collect();
    let mut object = Map::new();
    object.insert("simulation".to_owned(), json!(what));
    object.insert("kind".to_owned(), json!(kind.name()));
    object.extend(figures);
    object.insert("target".to_owned(), json!(truth.targets));
    for direction in Direction::ALL {
        let means = truth.profile.means(direction);
        object.insert(format!("mean_{}", direction.name()), json!(means));
    }
    Value::Object(object)
}
