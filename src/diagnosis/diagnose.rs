//! A diagnosis from a fitted model to its verdict.

use errsep_models::model::{Effect, FittedModel};

use crate::diagnosis::attribution::context::Context;
use crate::diagnosis::attribution::examined::examined;
use crate::diagnosis::detection::estimate::estimate;
use crate::diagnosis::noise::spikes::calmed;
use crate::diagnosis::options::Options;
use crate::diagnosis::verdict::compose::compose;
use crate::diagnosis::verdict::types::Diagnosis;

/// Diagnoses the gap of a fitted model with its own catalogue.
pub fn diagnose<M: FittedModel>(model: &M, options: &Options) -> Diagnosis {
    diagnose_with(model, model.effects(), options)
}

/// Diagnoses the gap of a fitted model with a given catalogue.
pub fn diagnose_with<M: FittedModel>(
    model: &M,
    catalogue: Vec<Box<dyn Effect<M>>>,
    options: &Options,
) -> Diagnosis {
    let catalogue: Vec<_> = catalogue
        .into_iter()
        .filter(|effect| !options.without.iter().any(|name| name == effect.name()))
        .collect();
    let (calmed, calm) = calmed(model);
    let model = calmed.as_ref().unwrap_or(model);
    let readings = model.linearised();
    let law = estimate(model, &readings).with_tails(calm.tails);
    let context = Context::new(model, &catalogue, law, options.draws, options.seed);
    examined(&context, &readings, options.false_alarm, |examined| {
        compose(&examined, &calm, options)
    })
}
