//! A gap as a law, or the power with which one would have been found.

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;
use serde::Serialize;

use crate::catalogue::tabulated::Tabulated;
use crate::detection::calm::calmed;
use crate::detection::estimate::estimate;
use crate::noise::law::NoiseLaw;
use crate::noise::spikes::Tails;
use crate::options::Options;
use crate::symbolic::bench::{Accepted, Bench, Refusal};
use crate::symbolic::injected::{Power, power};
use crate::symbolic::told::{LawTerm, effect, in_one_line, terms};
use crate::symbolic::view::Fitted;

/// Part by which the noise must change for laws to be sought anew without the best of them.
const ANEW: f64 = 0.02;
/// *Limit.* Rounds in which a law along the reading is taken out of the reading: each leaves that part of its error
/// that the law changes the reading by, a third at most.
const ROUNDS: usize = 5;
/// Part of a law's change by which a round may move it at the end.
const SETTLED: f64 = 1e-3;

/// Another law that predicts held-out repeats as well.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawRival {
    /// It in one line.
    pub formula: String,
    /// Standard deviations by which it predicts worse than the best.
    pub worse: f64,
}

/// A gap as a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// It as an effect, without its name and where it was seen.
    pub effect: Tabulated,
    /// Its terms with their parameters.
    pub terms: Vec<LawTerm>,
    /// Root mean square of its change of the readings.
    pub rms: f64,
    /// Part of the held-out gap, squared, that it predicts.
    pub explained: f64,
    /// Standard deviations by which held-out repeats confirm it.
    pub confirmed: f64,
    /// Forms of one term that were tried, and of two.
    pub tried: [usize; 2],
    /// Probability of as much anywhere in the grammar with nothing there.
    pub p_value: f64,
    /// Evidence for it over that for smooth curves: a gap of these shows as much in less than one of as many.
    pub odds: f64,
    /// Probability of what remains.
    pub adequacy: f64,
    /// Others that predict held-out repeats as well.
    pub rivals: Vec<LawRival>,
}

/// Why no law is told.
#[derive(Debug, Clone, PartialEq)]
pub struct NoLaw {
    /// In words.
    pub why: &'static str,
    /// The best of the grammar all the same.
    pub nearest: Option<String>,
    /// How often a law of this size would have been found; nothing where none was drawn.
    pub power: Option<Power>,
    /// Forms of one term that were tried, and of two.
    pub tried: [usize; 2],
}

/// What the search for a law came to.
#[derive(Debug, Clone, PartialEq)]
pub enum LawFound {
    /// A law.
    Law(Box<Law>),
    /// None.
    None(NoLaw),
}

/// Nothing was sought: there are no repeats to hold out, or too few different values of anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("there are no repeats to hold out, so nothing tells a law from chance")]
pub struct NoRepeats;

impl Refusal {
    fn words(self) -> &'static str {
        match self {
            Self::Nothing => "nothing of the grammar shows",
            Self::NotConfirmed => "repeats that were held out do not confirm any",
            Self::Smooth => "a smooth curve that is no law explains the gap as well",
            Self::Left => "the best leaves something that stands out",
            Self::NoNoise => {
                "what differs between repeats beside the best is no noise, which would excuse what it leaves"
            }
            Self::Chance => "noise alone shows as much too often",
        }
    }
}

/// `law` of a model of any kind.
pub(crate) fn law(
    model: &AnyModel,
    options: &Options,
    injections: usize,
) -> Result<LawFound, NoRepeats> {
    let (calmed, calm) = calmed(model);
    let model = calmed.as_ref().unwrap_or(model);
    let readings = model.linearised();
    let noise = estimate(model, &readings);
    let sigma = noise.sigma();
    let first = Bench::new(model, noise.with_tails(calm.tails), options).ok_or(NoRepeats)?;
    let attempt = first.attempt(&readings);
    let best = match &attempt {
        Ok(accepted) => Some(accepted.fitted.clone()),
        Err(_) => first
            .along_reading(&readings)
            .or_else(|| best_in_white(model, &first.law, &readings, options)),
    };
    let Some(best) = best else {
        let seeds = (options, injections);
        return Ok(none(&first, &readings, Refusal::Nothing, seeds));
    };
    if let Err(why) = attempt
        && !first.grammar.is_along_reading(&best.terms)
        && !changes_noise(model, &first, &best, sigma)
    {
        return Ok(none(&first, &readings, why, (options, injections)));
    }
    without(model, calm.tails, (&first, best), (options, injections))
}

/// Whether the noise is another one without a law.
fn changes_noise(model: &AnyModel, bench: &Bench<'_>, best: &Fitted, sigma: f64) -> bool {
    let change = bench.change(&best.terms, &best.amplitudes);
    let state = model.refit(model.observed() - change);
    let noise = estimate(&state, &state.linearised());
    (noise.sigma() / sigma - 1.0).abs() >= ANEW
}

/// What is found once noise and state are found again without the best law of a first search; the readings that a law
/// is a function of too, round by round.
fn without(
    model: &AnyModel,
    tails: Option<Tails>,
    (first, best): (&Bench<'_>, Fitted),
    seeds: (&Options, usize),
) -> Result<LawFound, NoRepeats> {
    let mut along = first.grammar.is_along_reading(&best.terms);
    let mut change = first.change(&best.terms, &best.amplitudes);
    let mut round = 1;
    loop {
        let state = model.refit(model.observed() - &change);
        let clean = state.linearised();
        let noise = estimate(&state, &clean).with_tails(tails);
        let bench = Bench::new(&state, noise, seeds.0).ok_or(NoRepeats)?;
        let readings = clean + &change;
        let attempt = bench.attempt(&readings);
        let next = match &attempt {
            _ if !along || round == ROUNDS => None,
            Ok(accepted) => Some(accepted.fitted.clone()),
            Err(_) => bench.along_reading(&readings),
        };
        if let Some(next) = next {
            let before =
                std::mem::replace(&mut change, bench.change(&next.terms, &next.amplitudes));
            if (&change - before).norm() > SETTLED * change.norm() {
                along = bench.grammar.is_along_reading(&next.terms);
                round += 1;
                continue;
            }
        }
        let told = match attempt {
            Ok(accepted) => told(&bench, &accepted, model).ok_or(Refusal::Nothing),
            Err(why) => Err(why),
        };
        return Ok(told.unwrap_or_else(|why| none(&bench, &readings, why, seeds)));
    }
}

/// The best law as it would be in white noise: what jumps or swings between traces passes for noise that
/// shifts them, and hides itself, until it is taken out once.
fn best_in_white(
    model: &AnyModel,
    law: &NoiseLaw,
    readings: &DVector<f64>,
    options: &Options,
) -> Option<Fitted> {
    let sigma = law.parts.white.sqrt();
    let white = NoiseLaw::white(sigma, law.freedom, law.source);
    Bench::new(model, white, options)?.best(readings)
}

fn tried(bench: &Bench<'_>) -> [usize; 2] {
    let forms = bench.forms();
    [forms, forms * (forms + 1) / 2]
}

fn none(
    bench: &Bench<'_>,
    readings: &DVector<f64>,
    why: Refusal,
    (options, injections): (&Options, usize),
) -> LawFound {
    let nearest = bench.best(readings);
    LawFound::None(NoLaw {
        why: why.words(),
        nearest: nearest.map(|best| in_one_line(&bench.grammar, &best, bench.model)),
        power: power(bench, bench.visible(readings), injections, options.seed),
        tried: tried(bench),
    })
}

fn told(bench: &Bench<'_>, accepted: &Accepted, model: &AnyModel) -> Option<LawFound> {
    let fitted = &accepted.fitted;
    let change = bench.change(&fitted.terms, &fitted.amplitudes);
    let rival = |(fitted, worse): &(_, f64)| LawRival {
        formula: in_one_line(&bench.grammar, fitted, model),
        worse: *worse,
    };
    Some(LawFound::Law(Box::new(Law {
        effect: effect(&bench.grammar, fitted, model)?,
        terms: terms(bench, fitted),
        rms: (change.norm_squared() / change.len().max(1) as f64).sqrt(),
        explained: accepted.explained,
        confirmed: accepted.confirmed,
        tried: tried(bench),
        p_value: accepted.p_value,
        odds: accepted.odds.exp().min(f64::MAX),
        adequacy: accepted.adequacy,
        rivals: accepted.rivals.iter().map(rival).collect(),
    })))
}
