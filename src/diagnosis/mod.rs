//! Where does the gap between model and readings lie, which effect causes it, how far does it
//! shrink once the effect is added: for any model that offers residuals, Jacobian and effects.
//!
//! The order is that of the functions of [`diagnose`]: noise first, then detection, then places,
//! causes, sizes and the verdict. The method and its sources are in `docs/theory/diagnosis.md`.

mod attribution;
mod catalogue;
mod detection;
mod joined;
mod levels;
mod noise;
mod options;
mod planning;
mod search;
mod severity;
pub mod turning;
mod verdict;

use errsep_models::model::{Effect, FittedModel};

use attribution::context::Context;
use attribution::examined::examined;
pub use attribution::reported::{Bias, Candidate, Elsewhere, Linear, ParameterOut};
pub use attribution::shrink::{HeldOut, Size};
pub use catalogue::formula::{Circumstances, Formula};
pub use catalogue::tabulated::{Tabulated, TabulatedEffects};
use detection::estimate::estimate;
pub use joined::{Joined, JoinedEffect, JoinedGap, JoinedProfile, NotJoined, joined};
pub use noise::law::{NoiseLaw, NoiseSource};
use noise::spikes::calmed;
pub use options::Options;
pub use planning::certificate::{Diagnosability, certificate};
pub use planning::prove::{Trials, prove};
pub use severity::agreement::{Agreement, agreement};
pub use severity::{Confidence, Rival, Severity};
pub use verdict::told::{Told, for_people, scaled};
pub use verdict::types::{
    Detail, Diagnosis, Fingerprint, Gap, Harm, Hidden, Kind, Nearest, NoiseOut, Verdict, Where,
};

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
        verdict::compose::compose(&examined, &calm, options)
    })
}
