//! Where does the gap between model and readings lie, which effect causes it, how far does it
//! shrink once the effect is added: for any model that offers residuals, Jacobian and effects.
//!
//! The order is that of the functions of [`diagnose`]: noise first, then detection, then places,
//! causes, sizes and the verdict. The method and its sources are in `docs/theory/diagnosis.md`.

mod attribution;
mod catalogue;
mod detection;
mod noise;
mod planning;
mod search;
mod verdict;

use errsep_models::model::{Effect, FittedModel};
use nalgebra::DVector;

use attribution::attribute::{attribute, roughly};
use attribution::confidence::Answer;
use attribution::context::{Context, Remainder};
pub use catalogue::formula::{Circumstances, Formula};
pub use catalogue::tabulated::{Tabulated, TabulatedEffects};
pub use noise::law::{NoiseLaw, NoiseSource};
use noise::spikes::Spikes;
pub use planning::certificate::{Diagnosability, certificate};
pub use planning::prove::{Trials, prove};
pub use verdict::told::{Told, for_people, scaled};
pub use verdict::types::{
    Bias, Candidate, Detail, Diagnosis, Elsewhere, Fingerprint, Gap, Harm, HeldOut, Hidden, Kind,
    Linear, Nearest, NoiseOut, ParameterOut, Size, Verdict, Where,
};

/// How a diagnosis is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Probability of naming anything where nothing is there.
    pub false_alarm: f64,
    /// Draws behind every tail probability.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// Effects to leave out of the catalogue.
    pub without: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            false_alarm: 0.01,
            draws: 1000,
            seed: 1,
            without: Vec::new(),
        }
    }
}

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
    let readings = model.linearised();
    let calm = Spikes::new(model).calmed(model, &readings);
    let calmed;
    let (model, readings) = if calm.count > 0 {
        calmed = model.refit(model.observed() + (&calm.readings - &readings));
        let readings = calmed.linearised();
        (&calmed, readings)
    } else {
        (model, readings)
    };
    let law = NoiseLaw::estimate(model, &readings).with_tails(calm.tails);
    let context = Context::new(model, &catalogue, law, options.draws, options.seed);
    examined(&context, &readings, options.false_alarm, |examined| {
        verdict::compose::compose(&examined, &calm, options)
    })
}

/// What a diagnosis has come to before it is put in words.
struct Examined<'a, M: FittedModel> {
    context: &'a Context<'a, M>,
    readings: &'a DVector<f64>,
    first: &'a Remainder,
    /// Probability of as much standing out with nothing there.
    detected: f64,
    found: Option<Answer>,
}

/// Causes bend the fitted state and swell the noise; both are found again without them, and the
/// diagnosis is made once more from there.
fn examined<M: FittedModel, R>(
    context: &Context<'_, M>,
    readings: &DVector<f64>,
    false_alarm: f64,
    then: impl FnOnce(Examined<'_, M>) -> R,
) -> R {
    let first = context.remainder(readings, &[]);
    let detected = context.detection(&first);
    if detected > false_alarm {
        return then(Examined {
            context,
            readings,
            first: &first,
            detected,
            found: None,
        });
    }
    let found = roughly(context, readings, &first);
    let none = || {
        (
            DVector::zeros(readings.len()),
            context.model.refit(context.model.observed().clone()),
        )
    };
    let (change, state) = context
        .changes(readings, &found)
        .map(|changes| {
            let clean = context.without(context.model.observed(), &found, &changes);
            (changes.column_sum(), context.model.refit(clean))
        })
        .unwrap_or_else(none);
    // The readings themselves keep what an effect had hidden of the state.
    let clean = context
        .model
        .refit(context.model.observed() - &change)
        .linearised();
    let law = NoiseLaw::estimate(&state, &clean);
    let context = context.moved(&state, law);
    let readings = clean + change;
    let first = context.remainder(&readings, &[]);
    let found = attribute(&context, &readings, &first);
    then(Examined {
        context: &context,
        readings: &readings,
        first: &first,
        detected,
        found,
    })
}
