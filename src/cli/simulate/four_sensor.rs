//! `errsep simulate four-sensor`: outputs of four sensors over a known surface, slide and zero.

use errsep_models::four_sensor::simulate::{Disturbances, Example, Truth, simulate};
use errsep_models::four_sensor::{FourSensorError, Geometry, Outputs, amplitude};
use serde_json::json;

use super::super::{Answer, CommonArgs};
use crate::io::{CsvTable, Message};

/// Outputs of the four-sensor method: the first example of Zhao et al. (2019) with curves of our own
/// for straightness and tilt.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Printed is the CSV that `errsep four-sensor` reads, with the set-up it needs as comments; --out
writes data.csv, setup.toml and truth.csv.

Example: errsep simulate four-sensor --noise 0.1 --seed 7 > data.csv")]
pub struct Args {
    /// Number of points of the surface, N.
    #[arg(long, alias = "points", value_name = "N", default_value_t = 69)]
    positions: usize,
    /// How often the surface is passed over.
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeats: usize,
    /// Sampling interval, mm.
    #[arg(long, value_name = "MM", default_value_t = 5.0)]
    step: f64,
    /// Spacings D2, D3, D4 of the sensors in steps.
    #[arg(
        long,
        alias = "spacing",
        value_name = "S2,S3,S4",
        value_delimiter = ',',
        default_values_t = [1, 1, 5]
    )]
    spacing_in_steps: Vec<usize>,
    /// Standard deviation of one reading, um.
    #[arg(long, value_name = "UM", default_value_t = 0.1)]
    noise: f64,
    /// Errors of the places of sensors 2, 3 and 4, mm (0.012,-0.003,0.017 is the paper's PE1).
    #[arg(
        long,
        value_name = "MM,MM,MM",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    sensor_position: Vec<f64>,
    /// Amplitude of the slide's positioning error, 1 is the paper's PE2.
    #[arg(
        long,
        value_name = "FACTOR",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    slide_position: f64,
    /// Drift of all sensors alike over the travel, um.
    #[arg(
        long,
        value_name = "UM",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    drift: f64,
    /// Relative gain error of each sensor.
    #[arg(
        long,
        value_name = "G,G,G,G",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    gain: Vec<f64>,
    /// Switch on an effect of the diagnosis's catalogue at a size, in its exact form; may be given
    /// several times. Sizes are in um, mm (positions) or shares (gains).
    #[arg(long = "effect", value_name = "NAME=VALUE")]
    effects: Vec<String>,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Simulates.
///
/// # Errors
/// A geometry without room for the sensors; a disturbance that is not finite or has the wrong count.
pub fn run(args: &Args) -> Result<Answer, Message> {
    super::few_enough(
        &[4, args.positions, args.repeats],
        "--positions or --repeats",
    )?;
    super::standard_deviations(&[("--noise", args.noise)])?;
    let spacing: [usize; 3] = exactly(&args.spacing_in_steps, "--spacing-in-steps")?;
    let reach = spacing
        .iter()
        .fold(0_usize, |sum, s| sum.saturating_add(*s));
    let geometry =
        Geometry::new(args.step, spacing, args.positions.saturating_sub(reach)).map_err(refuse)?;
    let truth = Example::of(&geometry);
    let mut disturbances = Disturbances::noise(args.noise);
    if !args.sensor_position.is_empty() {
        let [p2, p3, p4] = exactly(&args.sensor_position, "--sensor-position")?;
        disturbances.sensor_position = [0.0, p2, p3, p4];
    }
    if !args.gain.is_empty() {
        disturbances.gain = exactly(&args.gain, "--gain")?;
    }
    disturbances.slide_position = args.slide_position;
    disturbances.drift = args.drift;
    super::effects(
        &args.effects,
        &Disturbances::NAMES,
        amplitude,
        |name, size| disturbances.add(name, size).then_some(()),
    )?;
    let passes: Vec<Outputs> = (0..args.repeats.max(1))
        .map(|repeat| {
            let seed = super::seed_of(args.common.seed, repeat);
            disturbances.pass = (repeat, args.repeats.max(1));
            simulate(&geometry, &truth, &disturbances, seed)
        })
        .collect::<Result<_, _>>()
        .map_err(refuse)?;
    let outputs = &passes[0];

    let x = outputs.slide_positions();
    let sensor = |index: usize| -> Vec<f64> {
        let rows = passes.iter().flat_map(|pass| pass.readings());
        rows.map(|row| row[index]).collect()
    };
    let all = CsvTable::new("data.csv").numbers("x", x.repeat(passes.len()));
    let mut data = (0..4).fold(all, |table, index| {
        table.numbers(format!("m{}", index + 1), sensor(index))
    });
    if passes.len() > 1 {
        let numbers = (1..=passes.len()).flat_map(|k| vec![k as f64; x.len()]);
        data = data.numbers("repeat", numbers.collect::<Vec<_>>());
    }
    let surface_x = outputs.surface_positions();
    let of = |f: &dyn Fn(f64) -> f64, x: &[f64]| -> Vec<f64> { x.iter().map(|x| f(*x)).collect() };
    let surface = of(&|x| truth.surface(x), &surface_x);
    let straightness = of(&|x| truth.straightness(x), &x);
    let tilt = of(&|x| truth.tilt(x), &x);
    let places = geometry.positions();
    let spacings = [places[1], places[2] - places[1], places[3] - places[2]];
    let mut answer = super::answer(
        "four-sensor",
        data,
        json!({
            "spacing": {"value": spacings, "unit": "mm"},
            "noise": {"value": args.noise, "unit": "um"},
            "surface": {"x": surface_x, "f": surface, "unit": "um"},
            "straightness": {"x": x, "S": straightness, "unit": "um"},
            "tilt": {"x": x, "gamma": tilt, "unit": "rad"},
            "zero_adjustment": {"value": truth.zero_adjustment(), "unit": "um"},
            "effects": args.effects,
        }),
        args.common.seed,
    )?;
    super::add_setup(
        &mut answer,
        format!("[sensors]\nspacing = {spacings:?}\n"),
        "sensors",
        args.noise,
    );
    answer.tables.push(
        CsvTable::new("truth.csv")
            .numbers("x_mm", surface_x)
            .numbers("f_um", surface)
            .numbers("S_um", straightness)
            .numbers("gamma_rad", tilt),
    );
    Ok(answer)
}

fn exactly<T: Copy, const N: usize>(values: &[T], option: &str) -> Result<[T; N], Message> {
    values.try_into().map_err(|_| {
        Message::bad_input(format!("{option} has {} values", values.len()))
            .remedy(format!("give {N} values separated by commas"))
    })
}

fn refuse(error: FourSensorError) -> Message {
    Message::bad_input(error.to_string()).remedy(
        "give --points more than the sum of --spacing, and every other option a finite number",
    )
}
