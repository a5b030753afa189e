//! `errsep plan`: what a reversal could show of every effect, before any reading is taken; and designs
//! of it side by side.

mod compared;
mod designs;
mod planned;
mod told;

use std::path::PathBuf;

use errsep_models::model::FittedModel;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{Answer, CommonArgs};
use crate::diagnosis::{Diagnosability, NoiseLaw, NoiseSource, Options, certificate};
use crate::io::{Message, SetupFile};
use planned::{FORMS, LARGEST, LONGEST_TRAVEL, MOST_READINGS, Planned};
use told::{AT_LEAST, answer, effect_size, size};

/// What a planned reversal can show: visible part, smallest detectable and identifiable size,
/// confusions and harm of every effect, and which change of the plan helps most.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The set-up says what is planned and what is expected:

    noise = 0.02             # um, standard deviation of one reading
    travel = 300.0           # mm
    positions = 61
    repeats = 2
    both_directions = false
    tilts = [50.0, 0.0, 20.0]   # alpha, beta, gamma expected, urad
    forms = [1.0, 1.0]          # slide, artefact expected, um RMS

Designs of other angles are compared with each other, each as indicator/spindle in degrees:

    wanted = [\"alpha_h\", \"alpha_v\", \"M_h\", \"S\"]
    seconds_a_trace = 60.0      # one trace in one direction
    seconds_a_turn = 30.0       # turning the spindle
    seconds_an_indicator = 300.0
    indicators = 2              # that read at once
    [[design]]
    name = \"near and far\"
    channels = \"0/0,180/0,0/180,180/180\"
    [[design]]
    name = \"one indicator, every 90 degrees\"
    channels = \"0/0,0/90,0/180,0/270\"

Example: errsep plan plan.toml --out plan")]
pub struct Args {
    /// The plan.
    #[arg(value_name = "SETUP.toml")]
    plan: PathBuf,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Draws behind the thresholds of a plan.
const DRAWS: usize = 400;

/// Works out the certificate and what extra measurements would add.
///
/// # Errors
/// The set-up is bad, or the plan leaves nothing over to diagnose.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let setup = SetupFile::read(&args.plan)?;
    if compared::is_asked(&setup)? {
        return compared::run(args, &setup);
    }
    let planned = Planned::read(&setup)?;
    let rows = certified(&planned, args.common.seed).map_err(|m| m.in_file(&args.plan))?;
    let extras = extras(&planned)
        .into_iter()
        .map(|(name, plan)| {
            let with = certified(&plan, args.common.seed).map_err(|m| m.in_file(&args.plan))?;
            Ok((name, gain(&rows, &with), newly(&rows, &with)))
        })
        .collect::<Result<Vec<_>, Message>>()?;
    Ok(answer(args, &rows, extras))
}

fn certified(planned: &Planned, seed: u64) -> Result<Vec<Diagnosability>, Message> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut form = |rms: f64| TrueForm::random_waves(&mut random, rms, 1.5 * planned.travel, 12);
    let mut plan = Plan::even(0.0, planned.travel, planned.positions, 0.0);
    plan.m = form(planned.forms[0]);
    plan.s_a = form(planned.forms[1]);
    plan.s_b = form(planned.forms[1]);
    plan.alpha_rad = planned.tilts[0] * 1e-6;
    plan.beta_rad = planned.tilts[1] * 1e-6;
    plan.gamma_rad = planned.tilts[2] * 1e-6;
    plan.repeats = planned.repeats;
    plan.both_directions = planned.both_directions;
    let (observations, _) = simulate(&plan, &[]).map_err(|e| {
        Message::bad_input(e.to_string()).remedy("correct the expected tilts and forms")
    })?;
    let assumptions = Assumptions {
        convention: planned.convention,
        thickness: None,
        noise: Some(planned.noise),
    };
    let model = Linearised::new(&observations, assumptions)
        .map_err(|e| Message::bad_input(e.to_string()).remedy("plan more positions or repeats"))?;
    // Of a reading of the model, which may stand for several.
    let noise = model.stated_noise().unwrap_or(planned.noise);
    let law = NoiseLaw::white(noise, f64::INFINITY, NoiseSource::Stated);
    let options = Options {
        draws: DRAWS,
        seed,
        ..Options::default()
    };
    Ok(certificate(&model, model.effects(), &law, &options))
}

/// Changes of a plan that a shop can make.
fn extras(planned: &Planned) -> Vec<(&'static str, Planned)> {
    let mut extras = Vec::new();
    if !planned.both_directions {
        extras.push((
            "run every trace backward too",
            Planned {
                both_directions: true,
                ..planned.clone()
            },
        ));
    }
    extras.push((
        "take twice the repeats",
        Planned {
            repeats: 2 * planned.repeats,
            ..planned.clone()
        },
    ));
    extras.push((
        "read twice the positions",
        Planned {
            positions: 2 * planned.positions - 1,
            ..planned.clone()
        },
    ));
    extras.push((
        "tilt the artefact by a further 1 mrad",
        Planned {
            tilts: [
                planned.tilts[0],
                planned.tilts[1],
                planned.tilts[2] + 1000.0,
            ],
            ..planned.clone()
        },
    ));
    extras
}

/// Geometric mean of how much smaller the detectable sizes become.
fn gain(before: &[Diagnosability], after: &[Diagnosability]) -> f64 {
    let ratios: Vec<f64> = before
        .iter()
        .zip(after)
        .filter_map(|(b, a)| Some((b.detectable? / a.detectable?).ln()))
        .collect();
    (ratios.iter().sum::<f64>() / ratios.len().max(1) as f64).exp()
}

/// Effects that become visible.
fn newly(before: &[Diagnosability], after: &[Diagnosability]) -> Vec<String> {
    before
        .iter()
        .zip(after)
        .filter(|(b, a)| b.detectable.is_none() && a.detectable.is_some())
        .map(|(b, _)| b.effect.clone())
        .collect()
}
