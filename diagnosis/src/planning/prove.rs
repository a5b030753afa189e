//! A diagnosis that proves itself: sealed effects, and none, are put into the user's own readings
//! and diagnosed blind.
//!
//! The noise of a trial is what the fit left of the user's own traces, dealt out anew among the
//! traces and with random signs, so that its tails and its correlation are those of the data.
//! Sizes are drawn so that what the fit cannot absorb is 0.7 to 3 times the noise of one reading.

use std::collections::BTreeMap;

use errsep_models::model::{AnyModel, Effect, FittedModel};
use nalgebra::DVector;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::attribution::context::Context;
use crate::attribution::examined::{Examined, examined};
use crate::detection::calm::{calm, spikes};
use crate::detection::estimate::estimate;
use crate::detection::space::Space;
use crate::levels::PLANNED;
use crate::noise::law::{NoiseLaw, NoiseSource};
use crate::options::Options;

/// Most steps towards a size at which amplitude and signature belong together.
const SCALINGS: usize = 24;

/// Relative distance from the size drawn that is near enough.
const SCALED: f64 = 0.05;

/// How often each truth got each answer.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Trials {
    /// What was put in.
    pub truths: Vec<String>,
    /// What was said.
    pub answers: Vec<String>,
    /// Counts, truths × answers.
    pub counts: Vec<Vec<usize>>,
    /// Trials in which exactly what was put in was named, or nothing where nothing was.
    pub right: usize,
    /// Trials in which one effect was named and it was another.
    pub wrong: usize,
}

/// `prove` of a model of any kind.
pub(crate) fn prove(
    model: &AnyModel,
    catalogue: &[Box<dyn Effect<AnyModel>>],
    options: &Options,
    trials: usize,
) -> Trials {
    let readings = model.linearised();
    let spikes = spikes(model);
    let tails = calm(model, &spikes, &readings).tails;
    let context = Context::new(
        model,
        catalogue,
        estimate(model, &readings).with_tails(tails),
        options.draws,
        options.seed,
    );
    let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
    let plain = Space::new(model, &unit);
    let residual = plain.forward_vector(&readings);
    // The fit has taken a part of the noise with it.
    let swell = (readings.len() as f64 / plain.degrees_of_freedom().max(1) as f64).sqrt();
    let fitted = model.smooth().map_or_else(
        || &readings - &residual,
        |smooth| smooth + (&readings - model.observed()),
    );
    let seen: Vec<usize> = (0..catalogue.len())
        .filter(|k| {
            context
                .family_of(*k)
                .is_some_and(|f| context.dictionary.families[f].visible > PLANNED)
        })
        .collect();
    let outcomes: Vec<(String, String)> = (0..trials as u64)
        .into_par_iter()
        .map(|trial| {
            let mut random = ChaCha8Rng::seed_from_u64(options.seed);
            random.set_stream(trial + 1);
            let mut sealed = &fitted + dealt(model, &(&residual * swell), &mut random);
            let mut truth = "none".to_owned();
            if trial % 10 != 0 {
                // Some show such a size only where they are no longer plausible.
                let mut effects = seen.clone();
                effects.shuffle(&mut random);
                let put = effects.into_iter().find_map(|effect| {
                    let change = sealed_change(&context, &plain, effect, &mut random)?;
                    Some((catalogue[effect].name(), change))
                });
                if let Some((name, change)) = put {
                    sealed += change;
                    name.clone_into(&mut truth);
                }
            }
            spikes.pull_in(&mut sealed);
            (truth, answer(&context, &sealed, options))
        })
        .collect();
    count(outcomes)
}

/// The residuals of the traces, each given to another trace of the same length with a random sign.
fn dealt(model: &AnyModel, residual: &DVector<f64>, random: &mut ChaCha8Rng) -> DVector<f64> {
    let traces = model.traces();
    let mut givers: Vec<usize> = (0..traces.len()).collect();
    givers.shuffle(random);
    let mut noise = residual.clone();
    for (trace, giver) in traces.iter().zip(givers) {
        let from = traces[giver].clone();
        let giver = if from.len() == trace.len() {
            from
        } else {
            trace.clone()
        };
        let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        noise
            .rows_mut(trace.start, trace.len())
            .copy_from(&(sign * residual.rows(giver.start, giver.len())));
    }
    noise
}

/// An effect at a random shape and a size that shows, its signature that which belongs to its size.
fn sealed_change(
    context: &Context<'_>,
    plain: &Space,
    effect: usize,
    random: &mut ChaCha8Rng,
) -> Option<DVector<f64>> {
    let description = &context.catalogue[effect];
    let grid = description.grid(context.model);
    let n = context.space.readings();
    for _ in 0..30 {
        let mut shape = grid.get(random.random_range(0..grid.len().max(1)))?.clone();
        for k in 0..shape.values.len() {
            let mut moved = shape.clone();
            moved.values[k] += shape.steps[k] * (2.0 * random.random::<f64>() - 1.0);
            if description.allowed(context.model, &moved) {
                shape = moved;
            }
        }
        if !description.allowed(context.model, &shape) {
            continue;
        }
        let size = context.law.sigma() * (0.7 + 2.3 * random.random::<f64>());
        let mut amplitudes: Vec<f64> = description
            .amplitudes_at(&shape)
            .iter()
            .map(|parameter| {
                let sign = if parameter.low >= 0.0 || random.random_bool(0.5) {
                    1.0
                } else {
                    -1.0
                };
                sign * (0.5 + random.random::<f64>())
            })
            .collect();
        for _ in 0..SCALINGS {
            shape = description.settled(&shape, &amplitudes).unwrap_or(shape);
            let mut change = DVector::zeros(n);
            let columns = description.columns(context.model, &shape);
            for (column, amplitude) in columns.iter().zip(&amplitudes) {
                change += column.dense(n) * *amplitude;
            }
            let left = plain.forward_vector(&change).norm() / (n as f64).sqrt();
            let scale = size / left;
            let exact = vec![0.0; amplitudes.len()];
            let plausible = context.plausible(effect, &shape, &amplitudes, &exact);
            if !scale.is_finite() {
                break;
            }
            if (scale - 1.0).abs() < SCALED {
                return plausible.then_some(change);
            }
            amplitudes.iter_mut().for_each(|a| *a *= scale);
        }
    }
    None
}

/// The whole diagnosis of a trial, its noise estimated anew; only the null law is kept.
fn answer(context: &Context<'_>, sealed: &DVector<f64>, options: &Options) -> String {
    let shift = context.model.observed() - context.model.linearised();
    let model = context.model.refit(sealed + shift);
    let readings = model.linearised();
    let law = estimate(&model, &readings);
    let context = context.moved(&model, law);
    examined(&context, &readings, options.false_alarm, |examined| {
        said(&examined, options)
    })
}

fn said(examined: &Examined<'_>, options: &Options) -> String {
    if examined.detected > options.false_alarm {
        return "none".to_owned();
    }
    let context = examined.context;
    match &examined.found {
        Some(answer) if answer.complete && answer.groups.iter().all(|g| g.len() == 1) => {
            let mut names: Vec<&str> = answer
                .causes
                .iter()
                .map(|c| context.catalogue[c.effect].name())
                .collect();
            names.sort_unstable();
            names.join(" + ")
        }
        Some(answer) if answer.complete => "a group".to_owned(),
        _ => "unknown".to_owned(),
    }
}

fn count(outcomes: Vec<(String, String)>) -> Trials {
    let mut table: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    let mut trials = Trials::default();
    for (truth, answer) in outcomes {
        trials.right += usize::from(truth == answer);
        let named = !["none", "unknown", "a group"].contains(&answer.as_str());
        trials.wrong += usize::from(named && truth != answer);
        *table.entry(truth).or_default().entry(answer).or_default() += 1;
    }
    let mut answers: Vec<String> = table.values().flat_map(|row| row.keys().cloned()).collect();
    answers.sort();
    answers.dedup();
    trials.counts = table
        .values()
        .map(|row| {
            answers
                .iter()
                .map(|a| row.get(a).copied().unwrap_or(0))
                .collect()
        })
        .collect();
    trials.truths = table.into_keys().collect();
    trials.answers = answers;
    trials
}
