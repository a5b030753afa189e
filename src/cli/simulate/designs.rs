//! `errsep simulate reversal --design`: traces of any design with known slopes and forms.

use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{Design, SLOPES, angle_name};
use serde_json::{Map, Value, json};

use super::reversal::Args;
use crate::cli::Answer;
use crate::io::{CsvTable, Message};

/// Microradians in a radian, as the options are given.
const URAD: f64 = 1e-6;

/// Most readings that are simulated.
const MOST_READINGS: usize = 20_000_000;

/// Simulates the design that `--design` lists.
///
/// # Errors
/// Angles that are none, options that belong to the four channels, a number that makes no sense.
pub(super) fn run(args: &Args, text: &str) -> Result<Answer, Message> {
    let design = Design::parse(text).map_err(|why| {
        Message::bad_input(why.to_string()).remedy(
            "give --design as indicator/spindle in degrees, such as 0/0,180/0,0/180,180/180",
        )
    })?;
    let of_four = [
        (args.beta != 0.0, "--beta"),
        (args.spline.is_some(), "--spline"),
        (args.outliers != 0.0, "--outliers"),
        (!args.effects.is_empty(), "--effect"),
        (args.both_directions, "--both-directions"),
        (args.noise.len() != 1, "four figures of --noise"),
    ];
    if let Some((_, option)) = of_four.iter().find(|o| o.0) {
        return Err(
            Message::bad_input(format!("{option} cannot be had with --design"))
                .remedy("leave it out: it belongs to the channels 1A, 1B, 2A, 2B"),
        );
    }
    let readings = args.positions.saturating_mul(design.channels().len());
    if readings.saturating_mul(args.repeats as usize) > MOST_READINGS {
        return Err(
            Message::bad_input("that number of readings is not simulated")
                .remedy("give twenty million readings at most"),
        );
    }
    let [of_slide, of_side] = args.forms[..] else {
        return Err(Message::bad_input("--forms takes two figures")
            .remedy("give it as 1,0.5: slide, artefact"));
    };
    let kept = match args.kept[..] {
        [] => None,
        [e_1, e_2, o] => Some([e_1, e_2, o]),
        _ => {
            return Err(Message::bad_input("--kept takes three figures")
                .remedy("give e_1, e_2 and the oval part in um, such as 5,-3,0"));
        }
    };
    let plan = DesignPlan {
        slopes_rad: [
            args.alpha,
            args.alpha_v,
            args.gamma,
            args.gamma_2,
            args.cone,
            args.kappa_c,
            0.0,
        ]
        .map(|urad| urad * URAD),
        kept_um: kept,
        thickness_mm: args.thickness,
        length_mm: args.length,
        positions: args.positions,
        repeats: args.repeats,
        noise_um: args.noise[0],
        forms_um: [of_slide, of_side],
        seed: args.common.seed,
        design,
    };
    let (observations, truth) = simulate(&plan).map_err(|why| {
        Message::bad_input(why.to_string()).remedy("correct the options of the simulation")
    })?;
    let column = |of: &dyn Fn(&errsep_models::reversal::designs::DesignReading) -> f64| {
        observations.readings.iter().map(of).collect::<Vec<f64>>()
    };
    let channels = plan.design.channels();
    let table = CsvTable::new("readings.csv")
        .numbers("indicator", column(&|r| channels[r.channel].indicator))
        .numbers("spindle", column(&|r| channels[r.channel].spindle))
        .numbers("repeat", column(&|r| f64::from(r.repeat)))
        .numbers("time", column(&|r| r.time.unwrap_or(f64::NAN)))
        .numbers("x", column(&|r| r.x))
        .numbers("reading", column(&|r| r.value));
    let x = plan.x();
    let at = |form: &errsep_models::reversal::designs::simulate::WaveForm| -> Vec<f64> {
        x.iter().map(|x| form.at(*x)).collect()
    };
    let tilts: Map<String, Value> = SLOPES
        .iter()
        .zip(truth.slopes_rad)
        .map(|(name, rad)| ((*name).to_owned(), json!({"value": rad, "unit": "rad"})))
        .collect();
    let sides: Map<String, Value> = plan
        .design
        .sides()
        .iter()
        .zip(&truth.sides)
        .map(|(angle, form)| (angle_name(*angle), json!(at(form))))
        .collect();
    let known = json!({
        "tilts": tilts,
        "eccentricity": kept.map(|[e_1, e_2, o]| json!({"e_1": e_1, "e_2": e_2, "o": o, "unit": "um"})),
        "thickness": {"value": args.thickness, "unit": "mm"},
        "noise": {"std": args.noise[0], "unit": "um"},
        "forms": {"x": x, "M_h": at(&truth.slide[0]), "M_v": at(&truth.slide[1]), "S": sides},
    });
    let mut answer = super::answer("reversal", table, known, args.common.seed)?;
    let zero = if kept.is_some() { "kept" } else { "reset" };
    answer.setup = Some(format!(
        "[artefact]\nthickness = {:?}      # mm\n\n[indicator]\nzero = \"{zero}\"\n",
        args.thickness
    ));
    Ok(answer)
}
