//! Designs of a reversal, side by side: what each determines and how well, what it would show, how long
//! it takes.

use errsep_models::model::FittedModel;
use errsep_models::reversal::Direction;
use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{
    Design, DesignFit, DesignObservations, DesignOptions, Determined, FoundForm, Zero, fit,
};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::simultaneous::Noise;
use serde::Serialize;

use super::{DRAWS, MOST_READINGS};
use crate::diagnosis::{Diagnosability, NoiseLaw, NoiseSource, Options, certificate};
use crate::io::Message;

/// Two effects are confused where what one leaves is that of the other to this cosine: seen at three
/// times the smallest size they are not told apart with 99 % probability
/// (2.33 / sin(θ/2) = 3 · 5 standard deviations).
const CONFUSED: f64 = 0.95;

/// Forms of noise-free readings are finer than any knots; what knots are chosen is decided at this
/// share of the forms at least.
const LEAST_NOISE: f64 = 1e-3;

/// What is planned of every design alike.
#[derive(Debug, Clone)]
pub(super) struct Common {
    pub noise: f64,
    pub travel: f64,
    pub positions: usize,
    pub repeats: u32,
    pub both_directions: bool,
    /// α_h, α_v, γ_1, γ_2, cone, µrad.
    pub slopes: [f64; 5],
    /// Slide and sides, µm RMS.
    pub forms: [f64; 2],
    pub thickness: f64,
    pub zero: Zero,
    pub costs: Costs,
    pub wanted: Vec<String>,
    pub seed: u64,
}

/// Seconds of what is done in a measurement.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Costs {
    /// One trace in one direction.
    pub trace: f64,
    /// Turning the spindle to its next position.
    pub turn: f64,
    /// Setting up or re-setting an indicator.
    pub indicator: f64,
    /// Indicators that read at once.
    pub indicators: usize,
}

/// How long a design takes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Time {
    /// All, s.
    pub seconds: f64,
    /// Passes of the slide.
    pub passes: usize,
    /// Turns of the spindle.
    pub turns: usize,
    /// Indicators set up or re-set.
    pub settings: usize,
}

/// A quantity that is wanted, with its standard uncertainty where the design determines it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Wanted {
    pub quantity: String,
    /// rad of a slope, µm of a form (root mean square over the travel).
    pub std: Option<f64>,
    pub unit: &'static str,
}

/// What one design promises.
pub(super) struct Promise {
    pub name: String,
    pub design: Design,
    pub determined: Determined,
    pub wanted: Vec<Wanted>,
    pub effects: Vec<Diagnosability>,
    /// Pairs that are confused, in the order of the catalogue.
    pub confused: Vec<(String, String, f64)>,
    pub time: Time,
    /// Readings taken.
    pub readings: usize,
}

/// The promise of a design.
///
/// # Errors
/// The plan has too many readings, or cannot be fitted or diagnosed.
pub(super) fn promise(name: String, design: &Design, plan: &Common) -> Result<Promise, Message> {
    let named = |what: &dyn std::fmt::Display| format!("design {name}: {what}");
    let passes = plan.repeats as usize * if plan.both_directions { 2 } else { 1 };
    let readings = (plan.positions * design.channels().len()).saturating_mul(passes);
    if readings > MOST_READINGS {
        let what = format!("it is a plan of {readings} readings");
        return Err(Message::bad_input(named(&what)).remedy(format!(
            "plan fewer positions or repeats: {MOST_READINGS} readings at most"
        )));
    }
    let observations = readings_of(design, plan)
        .map_err(|why| Message::bad_input(named(&why)).remedy("correct what is expected"))?;
    let options = DesignOptions {
        zero: plan.zero,
        thickness_mm: plan.thickness,
        noise: Noise::Declared(plan.noise),
        ..DesignOptions::default()
    };
    let fit = fit(&observations, &options)
        .map_err(|why| Message::bad_input(named(&why)).remedy("plan more positions or repeats"))?;
    let effects = effects(&observations, plan).map_err(|why| {
        Message::bad_input(named(&why))
            .remedy("plan repeats or both directions, or channels such that something closes")
    })?;
    Ok(Promise {
        wanted: plan.wanted.iter().map(|w| wanted(&fit, w, plan)).collect(),
        confused: confused(&effects),
        determined: fit.determined.clone(),
        time: time(design, plan, passes),
        design: design.clone(),
        effects,
        readings,
        name,
    })
}

/// What the readings would be, in the order in which they are taken: in each position of the spindle
/// all repeats, forward and backward, the indicators at once.
fn readings_of(design: &Design, plan: &Common) -> Result<DesignObservations, String> {
    let [alpha_h, alpha_v, gamma_1, gamma_2, cone] = plan.slopes.map(|urad| urad * 1e-6);
    let directions = if plan.both_directions { 2 } else { 1 };
    let (made, _) = simulate(&DesignPlan {
        slopes_rad: [alpha_h, alpha_v, gamma_1, gamma_2, cone, 0.0, 0.0],
        kept_um: (plan.zero == Zero::Kept).then_some([0.0; 3]),
        thickness_mm: plan.thickness,
        length_mm: plan.travel,
        positions: plan.positions,
        // Each pass has noise of its own.
        repeats: plan.repeats * directions,
        noise_um: plan
            .noise
            .max(LEAST_NOISE * plan.forms[0].max(plan.forms[1])),
        forms_um: plan.forms,
        seed: plan.seed,
        ..DesignPlan::of(design.clone())
    })
    .map_err(|why| why.to_string())?;
    let positions = design.positions();
    let mut readings = made.readings;
    for reading in &mut readings {
        let spindle = design.channels()[reading.channel].spindle;
        let turn = positions.partition_point(|p| *p < spindle - 0.25) as u32;
        let of_turn = reading.repeat - 1;
        let part = reading.x / plan.travel;
        let (direction, along) = if of_turn.is_multiple_of(directions) {
            (Direction::Forward, part)
        } else {
            (Direction::Backward, 1.0 - part)
        };
        let pass = f64::from(turn * plan.repeats * directions + of_turn);
        reading.repeat = of_turn / directions + 1;
        reading.direction = direction;
        reading.time = Some(plan.costs.trace * (pass + along) + plan.costs.turn * f64::from(turn));
    }
    Ok(DesignObservations {
        design: design.clone(),
        readings,
    })
}

fn effects(
    observations: &DesignObservations,
    plan: &Common,
) -> Result<Vec<Diagnosability>, String> {
    let assumptions = Assumptions {
        thickness: (plan.thickness > 0.0).then_some(plan.thickness),
        noise: Some(plan.noise),
        ..Assumptions::default()
    };
    let model = Linearised::of_design(observations, plan.zero, None, assumptions)
        .map_err(|why| why.to_string())?;
    // Of a reading of the model, which may stand for several.
    let noise = model.stated_noise().unwrap_or(plan.noise);
    let law = NoiseLaw::white(noise, f64::INFINITY, NoiseSource::Stated);
    let options = Options {
        draws: DRAWS,
        seed: plan.seed,
        ..Options::default()
    };
    Ok(certificate(&model, model.effects(), &law, &options))
}

/// The standard uncertainty of a slope, or that of a form by its root mean square over the travel; of
/// `S` the greatest of all sides.
fn wanted(fit: &DesignFit, name: &str, plan: &Common) -> Wanted {
    let step = plan.travel / (plan.positions - 1) as f64;
    let x: Vec<f64> = (0..plan.positions).map(|k| k as f64 * step).collect();
    let is_form = name.starts_with('M') || name.starts_with('S');
    // What the knots miss of the supposed forms counts as noise in a fit; here the noise alone is wanted.
    let more = 1.0_f64.hypot(fit.agreement.missed / plan.noise);
    let by_noise = |f: &FoundForm| {
        let own = f.std.iter().map(|s| s * s - f.missed * f.missed);
        own.map(|square| square.max(0.0).sqrt() / more)
            .collect::<Vec<_>>()
    };
    let rms = |std: &[f64]| (std.iter().map(|s| s * s).sum::<f64>() / std.len() as f64).sqrt();
    let std = if is_form {
        let forms = fit.forms(&x).into_iter();
        let of = forms.filter(|f| f.name == name || (name == "S" && f.side.is_some()));
        let complete = name != "S" || {
            let told = fit.forms(&x[..1]);
            told.iter().filter(|f| f.side.is_some()).count() == fit.design.sides().len()
        };
        of.map(|f| rms(&by_noise(&f)))
            .reduce(f64::max)
            .filter(|_| complete)
    } else {
        fit.slope(name).map(|v| v.std / more)
    };
    Wanted {
        quantity: name.to_owned(),
        std,
        unit: if is_form { "um" } else { "rad" },
    }
}

/// Pairs of effects of which one leaves what the other does.
fn confused(effects: &[Diagnosability]) -> Vec<(String, String, f64)> {
    let like = |row: &Diagnosability, other: &str| {
        let own = row.rivals.iter().find(|(name, _)| name == other);
        own.map_or(0.0, |(_, cosine)| *cosine)
    };
    let mut pairs = Vec::new();
    for (k, second) in effects.iter().enumerate() {
        for first in &effects[..k] {
            let cosine = like(first, &second.effect).max(like(second, &first.effect));
            if cosine >= CONFUSED && first.detectable.is_some() && second.detectable.is_some() {
                pairs.push((first.effect.clone(), second.effect.clone(), cosine));
            }
        }
    }
    pairs
}

/// With fewer indicators than directions they are re-set, and the spindle goes round for each set-up.
fn time(design: &Design, plan: &Common, passes: usize) -> Time {
    let costs = plan.costs;
    let indicators = design.indicators();
    let (mut all, mut turns) = (0, 0_usize);
    for own in indicators.chunks(costs.indicators.max(1)) {
        let positions = design.positions().into_iter().filter(|p| {
            let same = |a: f64, b: f64| ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs() <= 0.5;
            let reads = |c: &errsep_models::reversal::designs::DesignChannel| {
                same(c.spindle, *p) && own.iter().any(|a| same(c.indicator, *a))
            };
            design.channels().iter().any(reads)
        });
        let count = positions.count();
        all += count * passes;
        turns += count;
    }
    let turns = turns.saturating_sub(1);
    let settings = indicators.len();
    Time {
        seconds: costs.trace * all as f64
            + costs.turn * turns as f64
            + costs.indicator * settings as f64,
        passes: all,
        turns,
        settings,
    }
}

/// A pair of effects that some designs confuse and others tell apart, by their places in the list.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ToldApart {
    pub pair: (String, String),
    pub confused_in: Vec<usize>,
    pub told_apart_in: Vec<usize>,
}

/// The pairs that are confused in one design and told apart, both being seen, in another.
pub(super) fn told_apart(promises: &[Promise]) -> Vec<ToldApart> {
    let mut found: Vec<ToldApart> = Vec::new();
    for promise in promises {
        for (first, second, _) in &promise.confused {
            let pair = (first.clone(), second.clone());
            if found.iter().any(|f| f.pair == pair) {
                continue;
            }
            let confuses = |p: &Promise| p.confused.iter().any(|c| c.0 == pair.0 && c.1 == pair.1);
            let shows = |p: &Promise, name: &str| {
                let own = p.effects.iter().find(|e| e.effect == name);
                own.is_some_and(|e| e.detectable.is_some())
            };
            let places = |of: &dyn Fn(&Promise) -> bool| -> Vec<usize> {
                (0..promises.len()).filter(|k| of(&promises[*k])).collect()
            };
            let told = places(&|p| !confuses(p) && shows(p, &pair.0) && shows(p, &pair.1));
            if !told.is_empty() {
                found.push(ToldApart {
                    confused_in: places(&confuses),
                    told_apart_in: told,
                    pair,
                });
            }
        }
    }
    found
}
