//! Where does the gap between model and readings lie, which effect causes it, how far does it
//! shrink once the effect is added: for any model that offers residuals, Jacobian and effects.
//!
//! The order is that of the functions of [`diagnose`]: noise first, then detection, then places,
//! causes, sizes and the verdict. The method and its sources are in `docs/theory/diagnosis.md`.

mod attribute;
mod bench;
mod dictionary;
mod folding;
mod geometry;
mod localise;
mod noise;
mod null;
mod prove;
mod quantify;
mod report;
mod search;
mod space;
mod tabulated;
mod verdict;
mod whitening;

use errsep_models::model::{Effect, FittedModel};
use nalgebra::DVector;

use attribute::{Answer, attribute};
use bench::{Bench, Remainder};
pub use geometry::{Diagnosability, certificate};
pub use noise::{NoiseLaw, NoiseSource};
pub use prove::{Trials, prove};
pub use tabulated::{Tabulated, TabulatedEffects};
pub use verdict::{
    Bias, Candidate, Detail, Diagnosis, Gap, Harm, HeldOut, Hidden, Kind, NoiseOut, ParameterOut,
    Size, Verdict, Where,
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
    let law = noise_of(model, &readings);
    let bench = Bench::new(model, &catalogue, law, options.draws, options.seed);
    let first = bench.remainder(&readings, &[]);
    if first.global > options.false_alarm {
        return report::compose(&bench, &readings, &first, first.global, None, options);
    }
    let found = attribute(&bench, &readings, &first);
    second_pass(&bench, &readings, &first, found.as_ref(), options)
}

/// Causes bend the fitted state and swell the noise; both are found again without them, and the
/// diagnosis is made once more from there.
fn second_pass<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    first: &Remainder,
    found: Option<&Answer>,
    options: &Options,
) -> Diagnosis {
    let detected = first.global;
    let change = found
        .and_then(|answer| {
            let (amplitudes, _) = bench.amplitudes(readings, &answer.causes)?;
            Some(bench.change(&answer.causes, &amplitudes))
        })
        .unwrap_or_else(|| DVector::zeros(readings.len()));
    let state = bench.model.refit(bench.model.observed() - &change);
    let clean = state.linearised();
    let law = noise_of(&state, &clean);
    let bench = bench.moved(&state, law);
    let readings = clean + change;
    let first = bench.remainder(&readings, &[]);
    let found = attribute(&bench, &readings, &first);
    report::compose(&bench, &readings, &first, detected, found, options)
}

fn noise_of<M: FittedModel>(model: &M, readings: &DVector<f64>) -> NoiseLaw {
    let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
    let residual = space::Space::new(model, &unit).forward_vector(readings);
    NoiseLaw::estimate(model, readings, &residual)
}
