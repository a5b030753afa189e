//! The questions that can be put to a fitted model. Each hands the model on as one of any kind
//! ([`AnyModel`]), so that all behind this file is compiled once and not once a model.

use errsep_models::model::{AnyModel, Effect, FittedModel};

use crate::agreement::{self, Agreement};
use crate::catalogue::tabulated::Tabulated;
use crate::diagnose as diagnosing;
use crate::joined::{self as joining, Joined, NotJoined};
use crate::learning::{self, Learnt, NotLearnt, Tested};
use crate::noise::law::NoiseLaw;
use crate::options::Options;
use crate::planning::certificate::{self as certifying, Diagnosability};
use crate::planning::prove::{self as proving, Trials};
use crate::sealing::{self, Checked, NotSealed, Sealed};
use crate::symbolic::{self, LawFound, NoRepeats};
use crate::verdict::types::Diagnosis;

/// The effects of one kind of model.
type Catalogue<M> = Vec<Box<dyn Effect<M>>>;

/// Diagnoses the gap of a fitted model with its own catalogue.
pub fn diagnose<M: FittedModel + 'static>(model: &M, options: &Options) -> Diagnosis {
    diagnose_with(model, model.effects(), options)
}

/// Diagnoses the gap of a fitted model with a given catalogue.
pub fn diagnose_with<M: FittedModel + 'static>(
    model: &M,
    catalogue: Catalogue<M>,
    options: &Options,
) -> Diagnosis {
    let catalogue = AnyModel::effects_of(catalogue);
    diagnosing::diagnose_with(&AnyModel::new(model), catalogue, options)
}

/// Fits effects of a catalogue along with a model.
///
/// # Errors
/// An effect is not known, or the readings do not determine it beside the model and the others.
pub fn joined<M: FittedModel + 'static>(
    model: &M,
    catalogue: Catalogue<M>,
    names: &[String],
    options: &Options,
) -> Result<Joined, NotJoined> {
    let catalogue = AnyModel::effects_of(catalogue);
    joining::joined(&AnyModel::new(model), catalogue, names, options)
}

/// The certificate of a plan.
pub fn certificate<M: FittedModel + 'static>(
    model: &M,
    catalogue: Catalogue<M>,
    law: &NoiseLaw,
    options: &Options,
) -> Vec<Diagnosability> {
    let catalogue = AnyModel::effects_of(catalogue);
    certifying::certificate(&AnyModel::new(model), &catalogue, law, options)
}

/// Puts sealed effects into a model's readings and diagnoses them blind; one trial in ten holds
/// none. The causes that were found in the readings are to be taken out of them beforehand.
pub fn prove<M: FittedModel + 'static>(
    model: &M,
    catalogue: Catalogue<M>,
    options: &Options,
    trials: usize,
) -> Trials {
    let catalogue = AnyModel::effects_of(catalogue);
    proving::prove(&AnyModel::new(model), &catalogue, options, trials)
}

/// Names what is in a model's readings, draws rivals of every name, `each` of each family, and names
/// every one by the score stage and by a diagnosis of its own. One row for each name and family.
pub fn agreement<M: FittedModel + 'static>(
    model: &M,
    options: &Options,
    each: usize,
) -> Vec<Agreement> {
    agreement::agreement(&AnyModel::new(model), options, each)
}

/// Learns what a model leaves of its readings, whatever the verdict on them.
///
/// # Errors
/// No repeats, or no smooth curve that held-out repeats confirm and that leaves nothing.
pub fn learn<M: FittedModel + 'static>(model: &M, options: &Options) -> Result<Learnt, NotLearnt> {
    learning::learn(&AnyModel::new(model), options)
}

/// Tests an effect of curves on readings; nothing where it was not learnt, or where nothing of it shows.
pub fn tested<M: FittedModel + 'static>(
    model: &M,
    effect: &Tabulated,
    options: &Options,
) -> Option<Tested> {
    learning::tested(&AnyModel::new(model), effect, options)
}

/// Seeks a law in what a model leaves of its readings, whatever the verdict on them; where there is none,
/// `injections` laws of the same size are put into the noise to say how many would have been found.
///
/// # Errors
/// There are no repeats.
pub fn law<M: FittedModel + 'static>(
    model: &M,
    options: &Options,
    injections: usize,
) -> Result<LawFound, NoRepeats> {
    symbolic::law(&AnyModel::new(model), options, injections)
}

/// What a plan is expected to show: `plan` is the model of the planned readings, whatever their values.
///
/// # Errors
/// Causes cannot join the fit, or what is planned does not follow from what was measured.
pub fn sealed<M: FittedModel + 'static>(
    model: &M,
    plan: &M,
    catalogue: Catalogue<M>,
    names: &[String],
    options: &Options,
) -> Result<Sealed, NotSealed> {
    let (model, plan) = (AnyModel::new(model), AnyModel::new(plan));
    sealing::sealed(
        &model,
        &plan,
        AnyModel::effects_of(catalogue),
        names,
        options,
    )
}

/// Compares a measurement with what was sealed; nothing where an effect is in the catalogue no more, or no
/// reading was planned.
pub fn checked<M: FittedModel + 'static>(
    model: &M,
    catalogue: Catalogue<M>,
    sealed: &Sealed,
    options: &Options,
) -> Option<Checked> {
    let catalogue = AnyModel::effects_of(catalogue);
    sealing::checked(&AnyModel::new(model), catalogue, sealed, options)
}
