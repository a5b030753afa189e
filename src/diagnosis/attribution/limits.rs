//! Causes that are freer than what they show: at the limit of their freedom they are another effect.

use errsep_models::model::{AnyModel, FittedModel, Shape};
use nalgebra::DVector;

use crate::diagnosis::attribution::context::{Cause, Context};

/// Rounds in which state and limit are fitted in turn.
const ROUNDS: usize = 3;

/// Whether the evidence for cause `k` of several is greater than that for its limit (Schwarz, Ann. Statist.
/// 6 (1978) 461).
pub(in crate::diagnosis) fn is_beyond_limit(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    k: usize,
) -> bool {
    let Cause { effect, shape, .. } = &causes[k];
    let limit_at = |state: &AnyModel| {
        let columns = context.catalogue[*effect].limit(state, shape);
        Cause {
            effect: *effect,
            shape: Shape::only(),
            projected: context.space.forward_columns(&columns).0,
            columns,
            choices: 0,
        }
    };
    if limit_at(context.model).columns.is_empty() {
        return true;
    }
    let own = context.misfit(readings, causes);
    let mut plain = causes.to_vec();
    // What the limit changes bends the state at which it is taken, as any cause does.
    (0..ROUNDS).all(|_| {
        let Some(changes) = context.changes(readings, &plain) else {
            return true;
        };
        let clean = context.without(readings, &plain, &changes);
        let state = context.model.refit_as_smooth(clean);
        let limit = limit_at(&context.seen_by(k, &state, &plain, &changes));
        let more = causes[k].unknowns().saturating_sub(limit.unknowns());
        plain[k] = limit;
        let gained = context.misfit(readings, &plain) - own;
        gained > more as f64 * (context.space.readings() as f64).ln()
    })
}
