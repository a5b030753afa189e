//! `errsep simulate fourier`.

use errsep_models::fourier::{
    Disturbance, FourierSimulation, Scan, ScanReading, amplitude, simulate_disturbed,
};
use serde_json::json;

use crate::cli::{Answer, CommonArgs};
use crate::io::{CsvTable, Message};

/// Scans of a workpiece on a slide by two or three probes.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Printed are the scans with the set-up they need as a comment; --out writes scans.csv and setup.toml.

Example: errsep simulate fourier --spacing 48.5 --spacing 34.1 --noise 2 > scans.csv")]
pub struct Args {
    /// Length of the section, mm.
    #[arg(long, default_value_t = 100.0, value_name = "MM")]
    length: f64,
    /// Grid points on the section.
    #[arg(long, alias = "samples", default_value_t = 1000, value_name = "N")]
    positions: usize,
    /// Probe spacing, mm; several with commas, or the option again for each (default 48.5, 34.1, 78.6).
    #[arg(long, value_name = "MM,...", value_delimiter = ',')]
    spacing: Vec<f64>,
    /// Repeats of each spacing.
    #[arg(long, default_value_t = 1, value_name = "N")]
    repeats: u32,
    /// Height difference of P2 and P3, um.
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "UM",
        allow_negative_numbers = true
    )]
    height_difference: f64,
    /// Slope of the workpiece, um per radian of the section's full turn.
    #[arg(
        long,
        default_value_t = 0.2,
        value_name = "UM",
        allow_negative_numbers = true
    )]
    slope: f64,
    /// Standard deviation of a reading, um.
    #[arg(long, default_value_t = 2.0, value_name = "UM")]
    noise: f64,
    /// Leave the third probe out.
    #[arg(long)]
    two_probes: bool,
    /// Switch on an effect of the diagnosis's catalogue at a size, in its exact form; may be given
    /// several times. Sizes are in um, mm (probe-spacing), rad (yaw) or shares (gain, travel-scale).
    #[arg(long = "effect", value_name = "NAME=VALUE")]
    effects: Vec<String>,
    #[command(flatten)]
    pub(in crate::cli) common: CommonArgs,
}

/// Makes the scans.
///
/// # Errors
/// Spacings outside the section, too few samples.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let defaults = FourierSimulation::default();
    let spacings = args.spacing.len().max(defaults.spacings.len());
    super::few_enough(
        &[3, spacings, args.positions, args.repeats as usize],
        "--positions or --repeats",
    )?;
    super::standard_deviations(&[("--noise", args.noise)])?;
    let what = FourierSimulation {
        length: args.length,
        samples: args.positions,
        spacings: if args.spacing.is_empty() {
            defaults.spacings.clone()
        } else {
            args.spacing.clone()
        },
        repeats: args.repeats,
        slope: args.slope,
        height_difference: args.height_difference,
        noise: args.noise,
        third_probe: !args.two_probes,
        // Behind the section the workpiece goes on as it begins, unless an effect says otherwise.
        step: (0.0, defaults.step.1),
        ..defaults
    };
    let seed = args.common.seed;
    let disturbances = super::effects(
        &args.effects,
        &Disturbance::NAMES,
        amplitude,
        |name, size| Disturbance::named(name, size, what.spacings.len()),
    )?;
    let is_beyond = |d: &Disturbance| matches!(d, Disturbance::BeyondTheSection(_));
    if what.third_probe && disturbances.iter().any(is_beyond) {
        let why =
            "--effect beyond-the-section: three probes do not read what is behind the section";
        return Err(Message::bad_input(why).remedy("give --two-probes with it"));
    }
    let (scans, truth) = simulate_disturbed(&what, &disturbances, seed).map_err(|e| {
        Message::bad_input(e.to_string())
            .remedy("change --spacing, --length, --positions or --noise")
    })?;
    let column = |of: &dyn Fn(&Scan, &ScanReading) -> f64| -> Vec<f64> {
        scans
            .iter()
            .flat_map(|s| s.readings.iter().map(move |r| (s, r)))
            .map(|(s, r)| of(s, r))
            .collect()
    };
    let mut table = CsvTable::new("scans.csv")
        .numbers("spacing", column(&|s, _| s.spacing))
        .numbers("repeat", column(&|s, _| f64::from(s.repeat)))
        .numbers("x", column(&|_, r| r.x))
        .numbers("m1", column(&|_, r| r.m1))
        .numbers("m2", column(&|_, r| r.m2.unwrap_or(f64::NAN)));
    if !args.two_probes {
        table = table.numbers("m3", column(&|_, r| r.m3.unwrap_or(f64::NAN)));
    }
    let mut answer = super::answer(
        "fourier",
        table,
        json!({"simulation": what, "profiles": truth, "effects": args.effects}),
        seed,
    )?;
    super::add_setup(
        &mut answer,
        format!("[section]\nlength = {:?}\n", args.length),
        "probe",
        args.noise,
    );
    Ok(answer)
}
