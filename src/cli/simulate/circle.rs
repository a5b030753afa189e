//! `errsep simulate circle`.

use errsep_models::circle::{CircleSimulation, Disturbance, Point, amplitude, simulate_disturbed};
use serde_json::json;

use crate::cli::{Answer, CommonArgs};
use crate::io::{CsvTable, Message};

/// Points of a circle with form and noise.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example: errsep simulate circle --radius 50 --arc 45 --noise 20 > points.csv")]
pub struct Args {
    /// Radius, mm.
    #[arg(long, default_value_t = 50.0, value_name = "MM")]
    radius: f64,
    /// Centre x, mm.
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "MM",
        allow_negative_numbers = true
    )]
    centre_x: f64,
    /// Centre y, mm.
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "MM",
        allow_negative_numbers = true
    )]
    centre_y: f64,
    /// Number of points.
    #[arg(long, alias = "points", default_value_t = 36, value_name = "N")]
    positions: usize,
    /// How often the circle is passed over.
    #[arg(long, default_value_t = 1, value_name = "N")]
    repeats: usize,
    /// Arc covered, degrees.
    #[arg(long, default_value_t = 360.0, value_name = "DEG")]
    arc: f64,
    /// Standard deviation of each coordinate, um.
    #[arg(long, default_value_t = 1.0, value_name = "UM")]
    noise: f64,
    /// A lobe of the form as undulations:amplitude in um, such as 3:2.5; several with commas, or the option
    /// again for each.
    #[arg(long, value_name = "N:UM,...", value_delimiter = ',', value_parser = parse_lobe)]
    lobe: Vec<(u32, f64)>,
    /// Switch on an effect of the diagnosis's catalogue at a size, in its exact form; may be given
    /// several times. Sizes are in um, those of scales are shares.
    #[arg(long = "effect", value_name = "NAME=VALUE")]
    effects: Vec<String>,
    #[command(flatten)]
    pub(in crate::cli) common: CommonArgs,
}

fn parse_lobe(text: &str) -> Result<(u32, f64), String> {
    text.split_once(':')
        .and_then(|(order, size)| Some((order.parse().ok()?, size.parse().ok()?)))
        .ok_or_else(|| "write undulations:amplitude, such as 3:2.5".to_owned())
}

/// Makes the points.
///
/// # Errors
/// A radius that is not positive, fewer than three points.
pub fn run(args: &Args) -> Result<Answer, Message> {
    super::few_enough(&[args.positions, args.repeats], "--positions or --repeats")?;
    super::standard_deviations(&[("--noise", args.noise)])?;
    let mut what = CircleSimulation {
        centre: Point::new(args.centre_x, args.centre_y),
        radius: args.radius,
        count: args.positions,
        start: 0.0,
        arc: args.arc.to_radians(),
        noise_um: args.noise,
        lobes: args.lobe.iter().map(|&(n, a)| (n, a, 0.0)).collect(),
        pass: (0, args.repeats.max(1)),
    };
    let seed = args.common.seed;
    let disturbances = super::effects(
        &args.effects,
        &Disturbance::NAMES,
        amplitude,
        |name, size| Disturbance::named(name, size, args.positions),
    )?;
    let mut points = Vec::new();
    let mut repeats = Vec::new();
    for repeat in 0..args.repeats {
        what.pass.0 = repeat;
        let pass = simulate_disturbed(&what, &disturbances, super::seed_of(seed, repeat));
        let pass = pass.map_err(|e| {
            Message::bad_input(e.to_string()).remedy("change --radius, --positions or --noise")
        })?;
        repeats.extend(pass.iter().map(|_| (repeat + 1) as f64));
        points.extend(pass);
    }
    let mut table = CsvTable::new("points.csv")
        .numbers("x", points.iter().map(|p| p.x).collect::<Vec<_>>())
        .numbers("y", points.iter().map(|p| p.y).collect::<Vec<_>>());
    if args.repeats > 1 {
        table = table.numbers("repeat", repeats);
    }
    super::answer(
        "circle",
        table,
        json!({
            "centre": [args.centre_x, args.centre_y],
            "radius": args.radius,
            "noise": {"value": args.noise, "unit": "um"},
            "effects": args.effects,
        }),
        seed,
    )
}
