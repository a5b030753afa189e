//! A diagnosis from a fitted model to its verdict.

use errsep_models::model::{AnyModel, Effect, FittedModel};

use crate::attribution::context::Context;
use crate::attribution::examined::examined;
use crate::detection::calm::calmed;
use crate::detection::estimate::estimate;
use crate::options::Options;
use crate::verdict::compose::compose;
use crate::verdict::types::Diagnosis;

/// `diagnose_with` of a model of any kind.
pub(super) fn diagnose_with(
    model: &AnyModel,
    catalogue: Vec<Box<dyn Effect<AnyModel>>>,
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
