//! The fit of a model with effects in it: state, noise and effects in turn, until each is had without what the others change.

use errsep_models::model::{AnyModel, Effect, FittedModel, Shape};
use nalgebra::DVector;

use super::NotJoined;
use crate::attribution::context::{Cause, Context};
use crate::attribution::examined::afresh;
use crate::detection::calm::calmed;
use crate::detection::estimate::{estimate, estimate_where, evidence};
use crate::levels::{INVISIBLE, LIKELIER_BY_DRIFTS, POLISHED};
use crate::noise::law::{Drifts, NoiseLaw};
use crate::options::Options;
use crate::search::Reach;
use crate::verdict::told::{drifting, pulled_in};

/// Fits of noise and state without the effects: the second begins with sizes that are nearly right.
const PASSES: usize = 2;

/// What is made of a fit that effects have joined: its workbench, the readings seen from there, the effects in
/// the order in which they are named, and what should be known beside.
pub(crate) fn in_the_fit<R>(
    model: &AnyModel,
    catalogue: Vec<Box<dyn Effect<AnyModel>>>,
    names: &[String],
    options: &Options,
    then: impl FnOnce(&Context<'_>, &DVector<f64>, &[Cause], Vec<String>) -> R,
) -> Result<R, NotJoined> {
    let chosen = chosen(catalogue, names)?;
    let (calmed, calm) = calmed(model);
    let model = calmed.as_ref().unwrap_or(model);
    let readings = model.linearised();
    let law = estimate(model, &readings).with_tails(calm.tails);
    let context = Context::new(model, &chosen, law, options.draws, options.seed);
    shown(&context)?;
    let mut seen = beside(&context, &readings);
    if drift_beside(&context, &seen) {
        let drifting = estimate_where(model, &readings, Drifts::Possible);
        seen = beside(&context.under(drifting), &readings);
    }
    let (state, law, readings) = seen;
    let context = context.moved(&state, law);
    let causes = fitted(&context, &readings);
    let mut notes = Vec::new();
    if calm.count > 0 {
        notes.push(pulled_in(calm.count));
    }
    notes.extend(drifting(context.model, &context.law));
    Ok(then(&context, &readings, &causes, notes))
}

/// State and noise without the effects, in turn with their shapes and sizes, and the readings seen from there.
fn beside(context: &Context<'_>, readings: &DVector<f64>) -> (AnyModel, NoiseLaw, DVector<f64>) {
    let causes = fitted(context, readings);
    let changes = context.changes(readings, &causes);
    let mut seen = afresh(context, &causes, changes.as_ref());
    for _ in 1..PASSES {
        let (state, law, readings) = seen;
        let moved = context.moved(&state, law);
        let causes = fitted(&moved, &readings);
        let changes = moved.changes(&readings, &causes);
        seen = afresh(context, &causes, changes.as_ref());
    }
    seen
}

/// Whether the repeats are likelier where whole traces drift, beside the effects.
fn drift_beside(
    context: &Context<'_>,
    (state, law, readings): &(AnyModel, NoiseLaw, DVector<f64>),
) -> bool {
    let moved = context.moved(state, law.clone());
    let causes = fitted(&moved, readings);
    let Some((amplitudes, _)) = moved.amplitudes(readings, &causes) else {
        return false;
    };
    let clean = readings - moved.change(&causes, &amplitudes);
    let of = |drifts| evidence(state, &clean, drifts);
    let both = of(Drifts::Possible).zip(of(Drifts::Never));
    both.is_some_and(|(drifting, steady)| drifting - steady > LIKELIER_BY_DRIFTS)
}

/// The effects that are given, in their order.
fn chosen(
    catalogue: Vec<Box<dyn Effect<AnyModel>>>,
    names: &[String],
) -> Result<Vec<Box<dyn Effect<AnyModel>>>, NotJoined> {
    let known: Vec<String> = catalogue.iter().map(|e| e.name().to_owned()).collect();
    let mut left: Vec<Option<Box<dyn Effect<AnyModel>>>> =
        catalogue.into_iter().map(Some).collect();
    let mut chosen = Vec::new();
    for name in names {
        let Some(at) = known.iter().position(|own| own == name) else {
            return Err(NotJoined::NoSuch {
                name: name.clone(),
                known,
            });
        };
        let effect = left[at]
            .take()
            .ok_or_else(|| NotJoined::Twice(name.clone()))?;
        if effect.absorbed() {
            return Err(NotJoined::Absorbed(name.clone()));
        }
        chosen.push(effect);
    }
    Ok(chosen)
}

/// Refuses what no reading could show.
fn shown(context: &Context<'_>) -> Result<(), NotJoined> {
    for (k, effect) in context.catalogue.iter().enumerate() {
        let name = || effect.name().to_owned();
        let family = context
            .family_of(k)
            .ok_or_else(|| NotJoined::Nowhere(name()))?;
        if context.dictionary.families[family].visible < INVISIBLE {
            return Err(NotJoined::Absorbed(name()));
        }
    }
    Ok(())
}

/// Every effect at its best shape beside the others, with the state that is left without them.
fn fitted(context: &Context<'_>, readings: &DVector<f64>) -> Vec<Cause> {
    let mut causes: Vec<Cause> = Vec::new();
    for effect in 0..context.catalogue.len() {
        let remainder = context.remainder(readings, &causes);
        let first = || {
            context.catalogue[effect]
                .grid(context.model)
                .into_iter()
                .next()
        };
        let start = context.start(&remainder, effect).cloned().or_else(first);
        let start = start.unwrap_or_else(Shape::only);
        let beside = context.beside(context.model, readings, &causes);
        let (cause, _) = beside.come_back(beside.refine(effect, (&start, Reach::WIDE)));
        causes.push(cause);
    }
    for _ in 0..if causes.len() > 1 { POLISHED } else { 0 } {
        for k in 0..causes.len() {
            let mut others = causes.clone();
            let own = others.remove(k);
            let start = (&own.shape, Reach::NEAR);
            let beside = context.beside(context.model, readings, &others);
            causes[k] = beside.refine(own.effect, start).0;
        }
    }
    context.relinearised(readings, &causes, f64::INFINITY)
}
