//! Whether fewer causes do what several do: one of them in another form of its own in the place of two.

use nalgebra::DVector;

use crate::attribution::confidence::{Answer, confidence_set};
use crate::attribution::context::{Cause, Context};
use crate::attribution::standing::without;
use crate::levels::chi_squared_quantile;

/// The answer with one cause less, where a relative of another, with no more unknowns than both, fits as well; else
/// the answer.
pub(crate) fn in_fewest(context: &Context<'_>, readings: &DVector<f64>, answer: Answer) -> Answer {
    let count = answer.causes.len();
    if count < 2 {
        return answer;
    }
    let misfit = context.misfit(readings, &answer.causes);
    let unknowns = |causes: &[Cause]| causes.iter().map(Cause::unknowns).sum::<usize>();
    let most = unknowns(&answer.causes);
    for left_out in 0..count {
        let fewer = without(&answer.causes, left_out);
        for k in 0..fewer.len() {
            let others = without(&fewer, k);
            let Cause { effect, shape, .. } = &fewer[k];
            let freer = context.catalogue[*effect]
                .relatives(context.model, shape)
                .into_iter()
                .map(|shape| context.cause(context.model, *effect, shape))
                .filter(|relative| relative.columns.len() > fewer[k].columns.len());
            for relative in freer {
                let mut trial = others.clone();
                trial.insert(k, relative);
                let Some(spared) = most.checked_sub(unknowns(&trial)) else {
                    continue;
                };
                let worse = context.misfit(readings, &trial) - misfit;
                if worse > chi_squared_quantile(0.99, spared.max(1)) {
                    continue;
                }
                let found = confidence_set(context, readings, &trial);
                if found.complete && found.causes.len() < count {
                    return found;
                }
            }
        }
    }
    answer
}
