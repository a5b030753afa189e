//! Detection and attribution in their order, and what they come to before it is put in words.

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};

use crate::attribution::attribute::{attribute, roughly};
use crate::attribution::confidence::Answer;
use crate::attribution::context::{Cause, Context};
use crate::attribution::correlated::correlated_instead;
use crate::attribution::drifting::drifts_instead;
use crate::attribution::remainder::Remainder;
use crate::detection::estimate::estimate_where;
use crate::noise::law::{Drifts, NoiseLaw, NoiseSource};

/// What a diagnosis has come to before it is put in words.
pub(crate) struct Examined<'a> {
    pub context: &'a Context<'a>,
    pub readings: &'a DVector<f64>,
    pub first: &'a Remainder,
    /// Probability of as much standing out with nothing there.
    pub detected: f64,
    pub found: Option<Answer>,
}

/// Causes bend the fitted state and swell the noise; both are found again without them, and the
/// diagnosis is made once more from there. Where drifts of whole traces explain the repeats better than what is found so,
/// all of it is done again with a law in which traces drift.
pub(crate) fn examined<R>(
    context: &Context<'_>,
    readings: &DVector<f64>,
    false_alarm: f64,
    then: impl FnOnce(Examined<'_>) -> R,
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
    let changes = context.changes(readings, &found);
    let (state, law, seen) = afresh(context, &found, changes.as_ref());
    let moved = context.moved(&state, law);
    let first = moved.remainder(&seen, &[]);
    let found = attribute(&moved, &seen, &first, &found);
    let examined = Examined {
        context: &moved,
        readings: &seen,
        first: &first,
        detected,
        found,
    };
    if context.law.drifts == Drifts::Never && drifts_instead(context, &examined) {
        let law = estimate_where(context.model, readings, Drifts::Possible);
        return self::examined(&context.under(law), readings, false_alarm, then);
    }
    if let Some(law) = correlated_instead(context, &examined) {
        return self::examined(&context.under(law), readings, false_alarm, then);
    }
    then(examined)
}

/// State and noise without what causes change in the readings, readings × causes, and the readings seen
/// from there. `context` is that of the readings as they came.
pub(crate) fn afresh(
    context: &Context<'_>,
    found: &[Cause],
    changes: Option<&DMatrix<f64>>,
) -> (AnyModel, NoiseLaw, DVector<f64>) {
    let observed = context.model.observed();
    let (change, state) = match changes {
        Some(changes) => {
            let clean = context.without(observed, found, changes);
            (changes.column_sum(), context.model.refit(clean))
        }
        None => (
            DVector::zeros(observed.len()),
            context.model.refit(observed.clone()),
        ),
    };
    // The readings themselves keep what an effect had hidden of the state.
    let clean = context.model.refit(observed - &change).linearised();
    let law = match context.law.source {
        NoiseSource::Residuals => context.law.clone(),
        _ => estimate_where(&state, &clean, context.law.drifts).with_tails_of(&context.law),
    };
    (state, law, clean + change)
}
