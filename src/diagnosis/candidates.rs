//! What each effect of the catalogue says of the gap.

use errsep_models::model::FittedModel;
use nalgebra::DVector;

use super::bench::{Bench, Cause, Remainder};
use super::confidence::Answer;
use super::dictionary::statistic;
use super::sizes::Sizes;
use super::verdict::Candidate;

/// What each effect explains, by that.
pub(super) fn candidates<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    first: &Remainder,
    excess: f64,
    found: Option<&Answer>,
    causes: &[Cause],
) -> Vec<Candidate> {
    let readings_count = bench.space.readings() as f64;
    let fitted = Sizes::fitted_with_state(bench, readings, causes);
    let mut list: Vec<(f64, Candidate)> = Vec::new();
    for (effect, description) in bench.catalogue.iter().enumerate() {
        let Some(family) = bench.family_of(effect) else {
            continue;
        };
        let about = description.about();
        let named = causes.iter().position(|c| c.effect == effect);
        let (cause, parameters) = match named {
            Some(which) => (
                Some(causes[which].clone()),
                fitted.as_ref().map(|f| f.of(bench, causes, which)),
            ),
            None => {
                let start = bench.start(first, effect).cloned();
                let cause = start.map(|shape| bench.cause(bench.model, effect, shape));
                let parameters = cause.as_ref().and_then(|cause| {
                    let alone = std::slice::from_ref(cause);
                    Some(Sizes::fitted(bench, readings, alone)?.of(bench, alone, 0))
                });
                (cause, parameters)
            }
        };
        let (t, unknowns) = cause.as_ref().map_or((0.0, 0), |c| {
            let gram = c.projected.tr_mul(&c.projected);
            let score = c.projected.tr_mul(&first.residual);
            let unknowns = c.projected.ncols() + c.shape.free();
            (statistic(&gram, &score, false), unknowns)
        });
        let in_set =
            found.is_some_and(|a| a.complete && a.groups.iter().any(|g| g.contains(&effect)));
        list.push((
            t,
            Candidate {
                effect: description.name().to_owned(),
                explained: ((t - unknowns as f64) / excess).clamp(0.0, 1.0),
                p_value: bench.p_value(first, effect),
                evidence: 0.5 * (t - unknowns as f64 * readings_count.ln()),
                visible: bench.dictionary.families[family].visible,
                in_set,
                variant: cause
                    .as_ref()
                    .and_then(|c| description.variant_name(bench.model, &c.shape)),
                parameters: parameters.into_iter().flatten().map(Into::into).collect(),
                physics: about.physics.to_owned(),
                confirm: about.confirm.to_owned(),
            },
        ));
    }
    list.sort_by(|a, b| {
        (b.1.in_set, b.0)
            .partial_cmp(&(a.1.in_set, a.0))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    list.into_iter().map(|(_, c)| c).collect()
}
