//! Causes that are freer than what they show: at the limit of their freedom they are another effect.

use errsep_models::model::Shape;
use nalgebra::DVector;

use crate::diagnosis::attribution::context::{Cause, Context};

/// Whether the evidence for cause `k` of several is greater than that for its limit (Schwarz, Ann. Statist.
/// 6 (1978) 461).
pub(in crate::diagnosis) fn is_beyond_limit(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    k: usize,
) -> bool {
    let Cause { effect, shape, .. } = &causes[k];
    let columns = context.catalogue[*effect].limit(context.model, shape);
    if columns.is_empty() {
        return true;
    }
    let limit = Cause {
        effect: *effect,
        shape: Shape::only(),
        projected: context.space.forward_columns(&columns).0,
        columns,
        choices: 0,
    };
    let more = causes[k].unknowns().saturating_sub(limit.unknowns());
    let mut plain = causes.to_vec();
    plain[k] = limit;
    let gained = context.misfit(readings, &plain) - context.misfit(readings, causes);
    gained > more as f64 * (context.space.readings() as f64).ln()
}
