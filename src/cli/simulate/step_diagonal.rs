//! `errsep simulate step-diagonal`.

use clap::ValueEnum;
use errsep_models::diagonal::{
    Component, Diagonal, DiagonalSimulation, Disturbance, Location, Sequence, Target, WorkZone,
    amplitude, simulate_disturbed,
};
use serde_json::{Value, json};

use crate::cli::{Answer, CommonArgs};
use crate::io::{CsvTable, Message};

/// Diagonals of the test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Which {
    /// The four body diagonals.
    Body,
    /// The two face diagonals of the bottom plane.
    Face,
}

/// What the tool carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum On {
    /// A mirror.
    Mirror,
    /// A retro-reflector.
    RetroReflector,
    /// One after the other.
    Both,
}

/// Step-diagonal readings of a machine with all 21 errors, by exact geometry.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example: errsep simulate step-diagonal --steps 5 --sequence XYZ --sequence ZYX > readings.csv")]
pub struct Args {
    /// Travel of X, Y, Z, mm.
    #[arg(
        long,
        num_args = 1..=3,
        value_names = ["X", "Y", "Z"],
        value_delimiter = ',',
        default_values_t = [600.0, 500.0, 400.0]
    )]
    travel: Vec<f64>,
    /// Steps on each axis.
    #[arg(long, default_value_t = 5, value_name = "N")]
    steps: usize,
    /// Diagonals.
    #[arg(long, value_enum, default_value_t = Which::Body)]
    diagonals: Which,
    /// Target.
    #[arg(long, value_enum, default_value_t = On::Mirror)]
    target: On,
    /// Sequence (XYZ, …, together); several with commas, or the option again for each (default: all six).
    #[arg(long, value_name = "SEQ,...", value_delimiter = ',', value_parser = parse_sequence)]
    sequence: Vec<Sequence>,
    /// Size of the translational errors, um.
    #[arg(long, default_value_t = 5.0, value_name = "UM")]
    translation: f64,
    /// Size of the angular and squareness errors, rad.
    #[arg(long, default_value_t = 20e-6, value_name = "RAD")]
    rotation: f64,
    /// Standard deviation of the mirror's misalignment, rad.
    #[arg(long, default_value_t = 50e-6, value_name = "RAD")]
    mirror: f64,
    /// Standard deviation of a reading, um.
    #[arg(long, default_value_t = 0.2, value_name = "UM")]
    noise: f64,
    /// Switch on an effect of the diagnosis's catalogue at a size, in its exact form; may be given
    /// several times. Sizes are in um or rad.
    #[arg(long = "effect", value_name = "NAME=VALUE")]
    effects: Vec<String>,
    /// How often each run is made.
    #[arg(long, default_value_t = 1, value_name = "N")]
    repeats: u32,
    /// Each run goes back to its start, without zeroing the laser.
    #[arg(long, alias = "backward")]
    both_directions: bool,
    /// Size of the reversal of the translational errors, um.
    #[arg(
        long,
        default_value_t = 1.0,
        value_name = "UM",
        requires = "both_directions"
    )]
    reversal: f64,
    /// Size of the reversal of the angular errors, rad.
    #[arg(
        long,
        default_value_t = 5e-6,
        value_name = "RAD",
        requires = "both_directions"
    )]
    reversal_rotation: f64,
    #[command(flatten)]
    pub(in crate::cli) common: CommonArgs,
}

fn parse_sequence(text: &str) -> Result<Sequence, String> {
    Sequence::from_name(text)
        .ok_or_else(|| "write XYZ, XZY, YXZ, YZX, ZXY, ZYX or together".to_owned())
}

/// Makes the readings.
///
/// # Errors
/// A work zone without volume or steps.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let [x, y, z] = args.travel[..] else {
        return Err(Message::bad_input("--travel needs three numbers").remedy("--travel X Y Z"));
    };
    let travel = [x, y, z];
    // Three moves a step, four diagonals, two targets, both directions.
    let sequences = args.sequence.len().max(Sequence::STEPS.len());
    super::few_enough(
        &[3, 4, 2, 2, sequences, args.steps, args.repeats as usize],
        "--steps or --repeats",
    )?;
    super::standard_deviations(&[
        ("--translation", args.translation),
        ("--rotation", args.rotation),
        ("--mirror", args.mirror),
        ("--noise", args.noise),
    ])?;
    let sizes = [args.reversal, args.reversal_rotation];
    let back = |size: f64| if args.both_directions { size } else { 0.0 };
    if args.steps == 0
        || travel.iter().any(|t| !(*t > 0.0 && t.is_finite()))
        || sizes.iter().any(|s| !s.is_finite())
    {
        return Err(
            Message::bad_input("the work zone or the sizes make no machine")
                .remedy("give positive travels, at least one step and finite sizes"),
        );
    }
    let what = DiagonalSimulation {
        zone: WorkZone {
            travel,
            steps: args.steps,
        },
        diagonals: match args.diagonals {
            Which::Body => Diagonal::BODY.to_vec(),
            Which::Face => Diagonal::FACE.to_vec(),
        },
        targets: match args.target {
            On::Mirror => vec![Target::Mirror],
            On::RetroReflector => vec![Target::RetroReflector],
            On::Both => vec![Target::Mirror, Target::RetroReflector],
        },
        sequences: match (&args.sequence[..], args.diagonals) {
            ([], Which::Body) => Sequence::STEPS.to_vec(),
            ([], Which::Face) => vec![Sequence::XYZ, Sequence::YXZ],
            (some, _) => some.to_vec(),
        },
        repeats: args.repeats.max(1),
        translation: args.translation,
        rotation: args.rotation,
        mirror: args.mirror,
        noise: args.noise,
        backward: args.both_directions,
        reversal: back(args.reversal),
        reversal_rotation: back(args.reversal_rotation),
    };
    let seed = args.common.seed;
    let disturbances = super::effects(
        &args.effects,
        &Disturbance::NAMES,
        amplitude,
        |name, size| Disturbance::named(name, size, &what),
    )?;
    let (readings, errors, mirrors) = simulate_disturbed(&what, &disturbances, seed);
    let position = |a: usize| -> Vec<f64> {
        readings
            .iter()
            .map(|r| what.zone.position(r.at)[a])
            .collect()
    };
    let text = |of: &dyn Fn(usize) -> String| (0..readings.len()).map(of).collect::<Vec<_>>();
    let mut table = CsvTable::new("readings.csv")
        .texts(
            "diagonal",
            text(&|i| readings[i].diagonal.name().to_owned()),
        )
        .texts(
            "sequence",
            text(&|i| readings[i].sequence.name().to_owned()),
        )
        .texts(
            "target",
            text(&|i| match readings[i].target {
                Target::Mirror => "mirror".to_owned(),
                Target::RetroReflector => "retro-reflector".to_owned(),
            }),
        )
        .texts("direction", text(&|i| readings[i].travel.name().to_owned()))
        .numbers("x", position(0))
        .numbers("y", position(1))
        .numbers("z", position(2))
        .numbers(
            "reading",
            readings.iter().map(|r| r.value).collect::<Vec<_>>(),
        );
    if args.repeats > 1 {
        let numbers = readings.iter().map(|r| f64::from(r.repeat));
        table = table.numbers("repeat", numbers.collect::<Vec<_>>());
    }
    let tabulated = |of: &dyn Fn(Component) -> Value| -> serde_json::Map<String, Value> {
        Component::all().map(|c| (c.name(), of(c))).collect()
    };
    let functions = tabulated(&|c| json!(errors.of(c)));
    let reversals = tabulated(&|c| json!(errors.reversal_of(c)));
    let squareness: serde_json::Map<String, Value> = Location::ALL
        .into_iter()
        .map(|l| {
            let value = l.iso_sign() * errors.squareness_of(l);
            (l.name().to_owned(), json!(value))
        })
        .collect();
    let misaligned: Vec<Value> = mirrors
        .iter()
        .map(|((diagonal, target), m)| {
            json!({"diagonal": diagonal, "target": target, "rotation": [m.x, m.y, m.z], "unit": "rad"})
        })
        .collect();
    super::answer(
        "step-diagonal",
        table,
        json!({
            "simulation": what,
            "functions": functions,
            "reversals": reversals,
            "squareness": squareness,
            "mirrors": misaligned,
            "effects": args.effects,
        }),
        seed,
    )
}
