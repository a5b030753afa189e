//! Where does the gap between model and readings lie, which effect causes it, how far does it
//! shrink once the effect is added: for any model that offers residuals, Jacobian and effects.
//!
//! The order is that of the functions of [`diagnose`]: noise first, then detection, then places,
//! causes, sizes and the verdict. The method and its sources are in `docs/theory/diagnosis.md`.

mod attribute;
mod bench;
mod bias;
mod candidates;
mod conclusion;
mod confidence;
mod contrasts;
mod dictionary;
mod doubt;
mod folding;
mod formula;
mod geometry;
mod hidden;
mod localise;
mod mixing;
mod noise;
mod null;
mod places;
mod posterior;
mod prove;
mod quantify;
mod refine;
mod refit;
mod report;
mod scatter;
mod search;
mod shape;
mod sizes;
mod space;
mod spikes;
mod splitting;
mod statement;
mod steps;
mod tabulated;
mod told;
mod verdict;
mod whitening;

use errsep_models::model::{Effect, FittedModel};
use nalgebra::DVector;

use attribute::{attribute, roughly};
use bench::{Bench, Remainder};
use confidence::Answer;
pub use formula::{Circumstances, Formula};
pub use geometry::{Diagnosability, certificate};
pub use noise::{NoiseLaw, NoiseSource};
pub use prove::{Trials, prove};
use spikes::Spikes;
pub use tabulated::{Tabulated, TabulatedEffects};
pub use told::{Told, for_people, scaled};
pub use verdict::{
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
    let bench = Bench::new(model, &catalogue, law, options.draws, options.seed);
    examined(&bench, &readings, options.false_alarm, |examined| {
        report::compose(&examined, &calm, options)
    })
}

/// What a diagnosis has come to before it is put in words.
struct Examined<'a, M: FittedModel> {
    bench: &'a Bench<'a, M>,
    readings: &'a DVector<f64>,
    first: &'a Remainder,
    /// Probability of as much standing out with nothing there.
    detected: f64,
    found: Option<Answer>,
}

/// Causes bend the fitted state and swell the noise; both are found again without them, and the
/// diagnosis is made once more from there.
fn examined<M: FittedModel, R>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    false_alarm: f64,
    then: impl FnOnce(Examined<'_, M>) -> R,
) -> R {
    let first = bench.remainder(readings, &[]);
    let detected = bench.detection(&first);
    if detected > false_alarm {
        return then(Examined {
            bench,
            readings,
            first: &first,
            detected,
            found: None,
        });
    }
    let found = roughly(bench, readings, &first);
    let none = || {
        (
            DVector::zeros(readings.len()),
            bench.model.refit(bench.model.observed().clone()),
        )
    };
    let (change, state) = bench
        .changes(readings, &found)
        .map(|changes| {
            let clean = bench.without(bench.model.observed(), &found, &changes);
            (changes.column_sum(), bench.model.refit(clean))
        })
        .unwrap_or_else(none);
    // The readings themselves keep what an effect had hidden of the state.
    let clean = bench
        .model
        .refit(bench.model.observed() - &change)
        .linearised();
    let law = NoiseLaw::estimate(&state, &clean);
    let bench = bench.moved(&state, law);
    let readings = clean + change;
    let first = bench.remainder(&readings, &[]);
    let found = attribute(&bench, &readings, &first);
    then(Examined {
        bench: &bench,
        readings: &readings,
        first: &first,
        detected,
        found,
    })
}
