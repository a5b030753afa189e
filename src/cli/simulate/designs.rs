//! `errsep simulate reversal --design`: traces of any design with known slopes and forms.

use errsep_models::reversal::Direction;
use errsep_models::reversal::designs::simulate::{
    DESIGN_EFFECTS, DesignEffect, DesignEffectKind, DesignPlan, frame, simulate,
};
use errsep_models::reversal::designs::{Design, SLOPES, angle_name};
use errsep_models::reversal::effects::amplitude_of_design;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Map, Value, json};

use super::reversal::Args;
use super::sizes;
use crate::cli::Answer;
use crate::io::reversal::StylusBeside;
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
        (args.noise.len() != 1, "four figures of --noise"),
    ];
    if let Some((_, option)) = of_four.iter().find(|o| o.0) {
        return Err(
            Message::bad_input(format!("{option} cannot be had with --design"))
                .remedy("leave it out: it belongs to the channels 1A, 1B, 2A, 2B"),
        );
    }
    let ways = 1 + usize::from(args.both_directions);
    let readings = args.positions.saturating_mul(design.channels().len());
    if readings.saturating_mul(args.repeats as usize * ways) > MOST_READINGS {
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
    let beside = beside(args, &design)?;
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
        crest: beside.as_ref().map(|crest| crest.of(&design)).transpose()?,
        length_mm: args.length,
        positions: args.positions,
        repeats: args.repeats,
        noise_um: args.noise[0],
        forms_um: [of_slide, of_side],
        both_directions: args.both_directions,
        turned_each_repeat: args.turn_each_repeat,
        interval_s: args.interval,
        effects: Vec::new(),
        seed: args.common.seed,
        design,
    };
    let effects = effects(args, &plan)?;
    let plan = DesignPlan {
        effects: effects.iter().map(|(_, effect)| *effect).collect(),
        ..plan
    };
    let (observations, truth) = simulate(&plan).map_err(|why| {
        Message::bad_input(why.to_string()).remedy("correct the options of the simulation")
    })?;
    let column = |of: &dyn Fn(&errsep_models::reversal::designs::DesignReading) -> f64| {
        observations.readings.iter().map(of).collect::<Vec<f64>>()
    };
    let channels = plan.design.channels();
    let readings = &observations.readings;
    let table = CsvTable::new("readings.csv")
        .numbers("indicator", column(&|r| channels[r.channel].indicator))
        .numbers("spindle", column(&|r| channels[r.channel].spindle))
        .numbers("repeat", column(&|r| f64::from(r.repeat)));
    let ways = readings
        .iter()
        .map(|r| u8::from(r.direction == Direction::Backward));
    let table = match args.both_directions {
        true => table.words(
            "direction",
            ["forward", "backward"],
            ways.collect::<Vec<_>>(),
        ),
        false => table,
    };
    let table = table
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
        "off_crest": plan.crest.as_ref().map(|crest| json!({
            "tip_radius": crest.tip_mm,
            "by_channel": crest.offset_mm,
            "unit": "mm",
        })),
        "noise": {"std": args.noise[0], "unit": "um"},
        "effects": effects.iter().map(|(name, effect)| json!({
            "effect": name,
            "size": {"value": effect.size, "unit": effect.unit()},
            "place": effect.place_in_words(&plan.design),
            "form": in_words(&effect.kind),
        })).collect::<Vec<_>>(),
        "forms": {"x": x, "M_h": at(&truth.slide[0]), "M_v": at(&truth.slide[1]), "S": sides},
    });
    let mut answer = super::answer("reversal", table, known, args.common.seed)?;
    let zero = if kept.is_some() { "kept" } else { "reset" };
    answer.setup = Some(format!(
        "[artefact]\nthickness = {:?}      # mm\n\n[indicator]\nzero = \"{zero}\"\n{}",
        args.thickness,
        beside.map_or_else(String::new, |crest| crest.as_toml())
    ));
    Ok(answer)
}

/// How the bar stands beside the styluses, where that is asked for.
fn beside(args: &Args, design: &Design) -> Result<Option<StylusBeside>, Message> {
    let Some(tip_radius) = args.tip_radius else {
        return Ok(None);
    };
    let indicators = design.indicators();
    let off_crest = match &args.off_crest[..] {
        [one] => vec![(None, *one)],
        each if each.len() == indicators.len() => {
            let angles = indicators.iter().map(|a| Some(*a));
            angles.zip(each.iter().copied()).collect()
        }
        each => {
            let (given, wanted) = (each.len(), indicators.len());
            let what = format!("--off-crest has {given} figures for {wanted} indicators");
            return Err(Message::bad_input(what).remedy(
                "give one figure for all, or one for each indicator in the order of their angles",
            ));
        }
    };
    Ok(Some(StylusBeside {
        tip_radius,
        off_crest,
    }))
}

/// The effects that are asked for, each with what is drawn for it.
fn effects(args: &Args, plan: &DesignPlan) -> Result<Vec<(String, DesignEffect)>, Message> {
    if args.effects.is_empty() {
        return Ok(Vec::new());
    }
    let refused = |why: String, remedy: String| Message::bad_input(why).remedy(remedy);
    let frame = frame(plan).map_err(|why| {
        Message::bad_input(why.to_string()).remedy("correct the options of the simulation")
    })?;
    // Of its own: the noise is the same with effects and without.
    let mut random = ChaCha8Rng::seed_from_u64(!args.common.seed);
    let one = |text: &String| {
        let (name, size) = text.split_once('=').ok_or_else(|| {
            refused(
                format!("--effect {text} has no size"),
                "give it as NAME=VALUE, such as thermal-drift=0.5".to_owned(),
            )
        })?;
        let size: f64 = size
            .trim()
            .parse()
            .ok()
            .filter(|v: &f64| v.is_finite())
            .ok_or_else(|| {
                refused(
                    format!("--effect {text}: {size} is not a number"),
                    "give the size in um, mm or rad as the catalogue does".to_owned(),
                )
            })?;
        let name = name.trim();
        if !DESIGN_EFFECTS.contains(&name) {
            let diagnosed = amplitude_of_design(&plan.design, name).is_some();
            return Err(super::not_made(name, &DESIGN_EFFECTS, diagnosed));
        }
        if name == "off-crest" && plan.thickness_mm == 0.0 {
            return Err(refused(
                "off-crest is the bend of a bar, and no --thickness is given".to_owned(),
                "give the diameter of the bar, such as --thickness 40".to_owned(),
            ));
        }
        let drawn = DesignEffect::named(name, size, &plan.design, &frame, &mut random);
        if let Some(effect) = &drawn {
            // What the simulation has in another unit than the catalogue is another quantity.
            let parameter =
                amplitude_of_design(&plan.design, name).filter(|p| p.unit == effect.unit());
            sizes::possible(name, size, parameter.as_ref())?;
        }
        drawn.map(|effect| (name.to_owned(), effect)).ok_or_else(|| {
            refused(
                format!("{name} belongs to the second position of the spindle, and this design has one"),
                "give a design with two positions of the spindle or more".to_owned(),
            )
        })
    };
    args.effects.iter().map(one).collect()
}

/// What of an effect is drawn beside its size and place.
fn in_words(kind: &DesignEffectKind) -> Value {
    use DesignEffectKind as Kind;
    match kind {
        Kind::AmbientCycle { cycles, phase } => json!({"cycles": cycles, "phase_rad": phase}),
        Kind::CyclicReading { period, phase } => json!({"period_um": period, "phase_rad": phase}),
        Kind::CyclicPosition { period, phase } => json!({"period_mm": period, "phase_rad": phase}),
        Kind::IndicatorNonlinearity { cubic } => json!({"power": if *cubic { 3 } else { 2 }}),
        Kind::LocalContamination { repeat, x, width } => {
            json!({"repeat": repeat, "x_mm": x, "width_mm": width})
        }
        Kind::OvalCone { sine } => json!({"of": if *sine { "kappa_s" } else { "kappa_c" }}),
        Kind::StickSlip { slips, state } => json!({"slips": slips, "state": state}),
        Kind::ThermalDrift { constant } => json!({"time_constant_s": constant}),
        Kind::ZeroJump { time } => json!({"time_s": time}),
        _ => json!({}),
    }
}
