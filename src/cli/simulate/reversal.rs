//! `errsep simulate reversal`: four traces of an artefact with known tilts and forms.

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::Direction;
use errsep_models::reversal::designs::simulate::DESIGN_EFFECTS;
use errsep_models::reversal::effects::amplitude;
use errsep_models::reversal::exact_readings::Injection;
use errsep_models::reversal::injected::{Injected, Undisturbed};
use errsep_models::reversal::simulate::{
    Disturbance, Plan, PlanError, TrueForm, Truth, even_grid, simulate,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::sizes;
use crate::cli::{Answer, CommonArgs};
use crate::io::{CsvTable, Message};

/// Most readings that are simulated.
const MOST_READINGS: usize = 20_000_000;

/// Most cells of a form.
const MOST_CELLS: usize = 100_000;

/// Positions at which the truth of the forms is given.
const TRUTH_POSITIONS: usize = 201;

/// Microradians in a radian, as the options are given.
const URAD: f64 = 1e-6;

/// The effects that are made of the four channels.
const EFFECTS: [&str; 14] = [
    "axis-backlash",
    "common-gain",
    "cyclic-error",
    "gain-mismatch",
    "gravity-sag",
    "hysteresis",
    "indicator-nonlinearity",
    "local-contamination",
    "reversal-shift",
    "taper",
    "thermal-drift",
    "thickness-shift",
    "tip-radius",
    "zero-jump",
];

/// The end of the help.
fn effects_and_examples() -> String {
    let further: Vec<&str> = DESIGN_EFFECTS
        .into_iter()
        .filter(|name| !EFFECTS.contains(name))
        .collect();
    format!(
        "Effects: {}.\nWith --design also {}.\n\nExamples:\n{EXAMPLES}",
        EFFECTS.join(", "),
        further.join(", ")
    )
}

const EXAMPLES: &str = "    errsep simulate reversal --alpha 40 --thickness 42 --noise 0.02 --seed 7 --out data
    errsep simulate reversal --design 0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180 --alpha-v 25 --out eight
    errsep simulate reversal --design 0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180 --repeats 3 --both-directions --effect thermal-drift=0.5 --out drifting";

/// Readings of a reversal in exact geometry, with known tilts and forms.
#[derive(Debug, clap::Args)]
#[command(after_help = effects_and_examples())]
pub struct Args {
    /// Tilt between slide and spindle axis, urad.
    #[arg(
        long,
        value_name = "URAD",
        default_value_t = 40.0,
        allow_hyphen_values = true
    )]
    pub(super) alpha: f64,
    /// Second tilt (sign of the spindle position), urad.
    #[arg(
        long,
        value_name = "URAD",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    pub(super) beta: f64,
    /// Third tilt (sign of the artefact's side), urad.
    #[arg(long, value_name = "URAD", default_value_t = -150.0, allow_hyphen_values = true)]
    pub(super) gamma: f64,
    /// Thickness of the artefact, mm.
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    pub(super) thickness: f64,
    /// Travel, mm.
    #[arg(long, value_name = "MM", default_value_t = 300.0)]
    pub(super) length: f64,
    /// Positions of each trace.
    #[arg(long, value_name = "N", default_value_t = 301)]
    pub(super) positions: usize,
    /// How often each trace is taken.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) repeats: u32,
    /// Take each repeat forward and backward.
    #[arg(long)]
    pub(super) both_directions: bool,
    /// With --design: turn the spindle in every repeat. Otherwise a position has all its repeats first.
    #[arg(long, requires = "design")]
    pub(super) turn_each_repeat: bool,
    /// Seconds from one reading to the next.
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    pub(super) interval: f64,
    /// Standard deviation of a reading, um: one figure, or four for 1A,1B,2A,2B.
    #[arg(
        long,
        value_name = "UM,...",
        value_delimiter = ',',
        default_value = "0.02"
    )]
    pub(super) noise: Vec<f64>,
    /// Root mean square of the slide's form and of the artefact's, um.
    #[arg(
        long,
        value_name = "UM,UM",
        value_delimiter = ',',
        default_value = "1,1"
    )]
    pub(super) forms: Vec<f64>,
    /// Make the forms cubic splines of so many cells in place of waves.
    #[arg(long, value_name = "CELLS")]
    pub(super) spline: Option<usize>,
    /// Share of readings that are outliers, of twenty times the noise.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    pub(super) outliers: f64,
    /// Switch on an effect of the diagnosis's catalogue at a size, in its exact form; may be given
    /// several times. Sizes are in um, mm or rad as the catalogue gives them.
    #[arg(long = "effect", value_name = "NAME=VALUE")]
    pub(super) effects: Vec<String>,
    /// Another design than the four channels: indicator/spindle of each channel, degrees. --alpha and
    /// --gamma are alpha_h and gamma_1 then.
    #[arg(long, value_name = "I/S,...")]
    design: Option<String>,
    /// Tilt between slide and spindle axis in the vertical plane, urad.
    #[arg(
        long,
        value_name = "URAD",
        default_value_t = 0.0,
        allow_hyphen_values = true,
        requires = "design"
    )]
    pub(super) alpha_v: f64,
    /// Tilt of the artefact along its side 90, urad.
    #[arg(
        long,
        value_name = "URAD",
        default_value_t = 0.0,
        allow_hyphen_values = true,
        requires = "design"
    )]
    pub(super) gamma_2: f64,
    /// Half the cone angle of the artefact, urad.
    #[arg(
        long,
        value_name = "URAD",
        default_value_t = 0.0,
        allow_hyphen_values = true,
        requires = "design"
    )]
    pub(super) cone: f64,
    /// Oval cone of the artefact, urad.
    #[arg(
        long,
        value_name = "URAD",
        default_value_t = 0.0,
        allow_hyphen_values = true,
        requires = "design"
    )]
    pub(super) kappa_c: f64,
    /// Indicators that keep their zeros: eccentricity e_1, e_2 and oval part o of the artefact, um.
    #[arg(
        long,
        value_name = "UM,UM,UM",
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "design"
    )]
    pub(super) kept: Vec<f64>,
    /// A round bar of the diameter --thickness under styluses of that radius, mm, that stand beside its crest.
    #[arg(long, value_name = "MM", requires = "design", requires = "off_crest")]
    pub(super) tip_radius: Option<f64>,
    /// How far the bar stands beside the stylus at the middle of the travel, mm, positive towards growing
    /// angles of the indicator: one figure, or one for each indicator in the order of their angles.
    #[arg(
        long,
        value_name = "MM,...",
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "tip_radius"
    )]
    pub(super) off_crest: Vec<f64>,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    if let Some(design) = &args.design {
        return super::designs::run(args, design);
    }
    let plan = plan(args)?;
    let refused = |error: PlanError| {
        Message::bad_input(error.to_string()).remedy("correct the options of the simulation")
    };
    let undisturbed = Undisturbed::of(&plan).map_err(refused)?;
    let effects = effects(args, &undisturbed)?;
    let mut in_order: Vec<Injection> = effects.iter().map(|(_, effect)| *effect).collect();
    in_order.sort_by_key(|effect| effect.stage());
    let placed: Vec<Injected> = in_order
        .into_iter()
        .map(|effect| Injected::new(effect, &undisturbed))
        .collect();
    let disturbances: Vec<&dyn Disturbance> =
        placed.iter().map(|d| d as &dyn Disturbance).collect();
    let (observations, truth) = simulate(&plan, &disturbances).map_err(refused)?;
    let readings = &observations.readings;
    let column = |of: &dyn Fn(&errsep_models::reversal::Reading) -> f64| -> Vec<f64> {
        readings.iter().map(of).collect()
    };
    let direction = |d: Direction| match d {
        Direction::Forward => "forward",
        Direction::Backward => "backward",
    };
    let table = CsvTable::new("readings.csv")
        .texts(
            "channel",
            readings
                .iter()
                .map(|r| r.channel.name().to_owned())
                .collect::<Vec<_>>(),
        )
        .numbers("repeat", column(&|r| f64::from(r.repeat)))
        .texts(
            "direction",
            readings
                .iter()
                .map(|r| direction(r.direction).to_owned())
                .collect::<Vec<_>>(),
        )
        .numbers("time", column(&|r| r.time.unwrap_or(f64::NAN)))
        .numbers("x", column(&|r| r.x))
        .numbers("reading", column(&|r| r.value));
    let answer = super::answer(
        "reversal",
        table,
        known(args, &truth, &effects),
        args.common.seed,
    )?;
    Ok(Answer {
        setup: Some(setup(args)),
        ..answer
    })
}

/// What a person would know beside the readings.
fn setup(args: &Args) -> String {
    let mut setup = String::new();
    if args.thickness > 0.0 {
        setup += &format!("[artefact]\nthickness = {:?}  # mm\n\n", args.thickness);
    }
    setup + "[model]\nconvention = \"seed\"\n"
}

fn plan(args: &Args) -> Result<Plan, Message> {
    let refuse = |what: &str, remedy: &str| Err(Message::bad_input(what).remedy(remedy));
    let directions = if args.both_directions { 2 } else { 1 };
    let readings = args
        .positions
        .checked_mul(4 * directions)
        .and_then(|n| n.checked_mul(args.repeats as usize));
    if readings.is_none_or(|n| n > MOST_READINGS) || args.positions < 2 || args.repeats < 1 {
        return refuse(
            "that number of readings is not simulated",
            "give two or more --positions, one or more --repeats, twenty million readings at most",
        );
    }
    if !(args.length > 0.0) || !args.length.is_finite() {
        return refuse(
            "the travel must be greater than zero",
            "give --length in mm",
        );
    }
    for value in &args.noise {
        super::standard_deviations(&[("--noise", *value)])?;
    }
    if ![1, 4].contains(&args.noise.len()) {
        return refuse(
            "noise is one figure or four",
            "give --noise as 0.02 or as 0.01,0.02,0.03,0.02",
        );
    }
    let [of_slide, of_artefact] = args.forms[..] else {
        return refuse(
            "--forms takes two figures",
            "give it as 1,0.5: slide, artefact",
        );
    };
    if !args.forms.iter().all(|rms| rms.is_finite() && *rms >= 0.0) {
        return refuse(
            "--forms takes root mean squares in um",
            "give finite numbers, zero or greater, such as 1,0.5",
        );
    }
    if args.spline.is_some_and(|cells| cells > MOST_CELLS) {
        return refuse(
            "a form of so many cells is not simulated",
            "give --spline 100000 cells at most",
        );
    }
    let mut rng = ChaCha8Rng::seed_from_u64(args.common.seed);
    let mut form = |rms: f64| -> Result<TrueForm, Message> {
        match args.spline {
            None => Ok(TrueForm::random_waves(&mut rng, rms, 1.5 * args.length, 12)),
            Some(cells) => {
                let basis = CubicBSpline::uniform(0.0, args.length, cells).map_err(|e| {
                    Message::bad_input(e.to_string()).remedy("give --spline one cell or more")
                })?;
                Ok(TrueForm::random_spline(&mut rng, basis, rms))
            }
        }
    };
    let mut plan = Plan::even(0.0, args.length, args.positions, 0.0);
    plan.m = form(of_slide)?;
    plan.s_a = form(of_artefact)?;
    plan.s_b = form(of_artefact)?;
    plan.alpha_rad = args.alpha * URAD;
    plan.beta_rad = args.beta * URAD;
    plan.gamma_rad = args.gamma * URAD;
    plan.thickness_mm = args.thickness;
    for (c, trace) in plan.traces.iter_mut().enumerate() {
        trace.noise = args.noise[c % args.noise.len()];
    }
    plan.repeats = args.repeats;
    plan.both_directions = args.both_directions;
    plan.seconds_a_reading = args.interval;
    plan.outlier_share = args.outliers;
    // Another stream than that of the forms.
    plan.seed = args.common.seed.wrapping_add(1 << 32);
    Ok(plan)
}

/// The effects asked for; what a name and a size leave open is drawn from the seed.
fn effects(args: &Args, undisturbed: &Undisturbed) -> Result<Vec<(String, Injection)>, Message> {
    let mut random = ChaCha8Rng::seed_from_u64(args.common.seed.wrapping_add(2 << 32));
    args.effects
        .iter()
        .map(|text| {
            let bad = |what: String| {
                Message::bad_input(what)
                    .remedy("give --effect as NAME=VALUE, such as --effect taper=5e-6")
            };
            let (name, value) = text
                .split_once('=')
                .ok_or_else(|| bad(format!("`{text}` is not NAME=VALUE")))?;
            let size: f64 = value
                .trim()
                .parse()
                .ok()
                .filter(|v: &f64| v.is_finite())
                .ok_or_else(|| bad(format!("`{value}` is not a number")))?;
            let name = name.trim();
            let parameter = amplitude(name);
            if !EFFECTS.contains(&name) && DESIGN_EFFECTS.contains(&name) {
                return Err(Message::bad_input(format!(
                    "`{name}` is an effect of errsep diagnose that is made with --design alone"
                ))
                .remedy(format!(
                    "give --design, such as --design 0/0,180/0,180/180,0/180 for the four channels; without it there are {}",
                    EFFECTS.join(", ")
                )));
            }
            sizes::possible(name, size, parameter.as_ref())?;
            let effect = Injection::named(name, size, &undisturbed.frame, &mut random)
                .ok_or_else(|| super::not_made(name, &EFFECTS, parameter.is_some()))?;
            Ok((name.to_owned(), effect))
        })
        .collect()
}

fn known(args: &Args, truth: &Truth, effects: &[(String, Injection)]) -> Value {
    let x = even_grid(0.0, args.length, TRUTH_POSITIONS);
    let at = |form: &errsep_models::reversal::simulate::GaugedForm| -> Vec<f64> {
        x.iter().map(|x| form.at(*x)).collect()
    };
    let angle = |rad: f64| json!({"value": rad, "unit": "rad"});
    json!({
        "tilts": {
            "alpha": angle(truth.alpha_rad),
            "beta": angle(truth.beta_rad),
            "gamma": angle(truth.gamma_rad),
        },
        "thickness": {"value": args.thickness, "unit": "mm"},
        "noise": {"std": args.noise, "unit": "um"},
        "forms": {"M": at(&truth.m), "S_A": at(&truth.s_a), "S_B": at(&truth.s_b), "x": x},
        "outliers": truth.outliers,
        "effects": effects
            .iter()
            .map(|(name, effect)| json!({"effect": name, "exact": format!("{effect:?}")}))
            .collect::<Vec<_>>(),
    })
}
