//! What each effect of the catalogue says of the gap.

use std::collections::BTreeMap;

use errsep_models::model::{Estimate, Shape};
use nalgebra::DVector;

use crate::attribution::alternatives::Alternative;
use crate::attribution::context::{Cause, Context};
use crate::attribution::remainder::Remainder;
use crate::attribution::reported::{Candidate, Elsewhere};
use crate::attribution::sizes::Sizes;
use crate::attribution::standing::{possible, without};
use crate::detection::dictionary::statistic;
use crate::levels::chi_squared_of_two;
use crate::search::Reach;

/// What each effect explains, by that. `groups` are those of the causes, where they are named.
pub(crate) fn candidates(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
    excess: f64,
    groups: &[Vec<Alternative>],
    causes: &[Cause],
) -> Vec<Candidate> {
    let readings_count = context.space.readings() as f64;
    let fitted = Sizes::told(context, readings, causes);
    let mut list: Vec<(f64, Candidate)> = Vec::new();
    for (effect, description) in context.catalogue.iter().enumerate() {
        let Some(family) = context.family_of(effect) else {
            continue;
        };
        let about = description.about();
        let named = causes.iter().position(|c| c.effect == effect);
        let member = groups.iter().enumerate().find_map(|(k, group)| {
            let own = group.iter().find(|a| a.cause.effect == effect)?;
            Some((k, own))
        });
        let (cause, parameters) = match named {
            Some(which) => {
                let own = fitted.as_ref().map(|f| f.of(context, causes, which));
                (Some(causes[which].clone()), own)
            }
            None => not_named(context, (readings, first), causes, effect, member),
        };
        let (t, unknowns) = cause.as_ref().map_or((0.0, 0), |c| {
            let gram = c.projected.tr_mul(&c.projected);
            let score = c.projected.tr_mul(&first.residual);
            (statistic(&gram, &score, false), c.unknowns())
        });
        let alone = 0.5 * (t - unknowns as f64 * readings_count.ln());
        list.push((
            t,
            Candidate {
                effect: description.name().to_owned(),
                // No negative zero.
                explained: ((t - unknowns as f64) / excess).clamp(0.0, 1.0) + 0.0,
                p_value: context.p_value(first, effect),
                evidence: member.map_or(alone, |(_, own)| own.evidence),
                visible: context.dictionary.families[family].visible,
                in_set: member.is_some(),
                variant: cause
                    .as_ref()
                    .and_then(|c| description.variant_name(context.model, &c.shape)),
                parameters: parameters.into_iter().flatten().map(Into::into).collect(),
                elsewhere: named.map_or_else(Vec::new, |which| {
                    elsewhere(context, readings, causes, which)
                }),
                physics: about.physics.to_owned(),
                confirm: about.confirm.to_owned(),
            },
        ));
    }
    in_order(list)
}

/// An effect that is not named, in the place of the cause whose group it is in or alone, with its parameters.
fn not_named(
    context: &Context<'_>,
    (readings, first): (&DVector<f64>, &Remainder),
    causes: &[Cause],
    effect: usize,
    member: Option<(usize, &Alternative)>,
) -> (Option<Cause>, Option<Vec<Estimate>>) {
    if let Some((k, own)) = member {
        let mut trial = causes.to_vec();
        trial[k] = own.cause.clone();
        let parameters = fitted_alone(context, readings, &trial, k);
        return (Some(own.cause.clone()), parameters);
    }
    let start = context.start(first, effect).cloned();
    let cause = start.map(|shape| context.cause(context.model, effect, shape));
    let alone = cause.as_ref().map(std::slice::from_ref);
    let parameters = alone.and_then(|own| fitted_alone(context, readings, own, 0));
    (cause, parameters)
}

/// The parameters of one of several causes that are fitted without the state.
fn fitted_alone(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    which: usize,
) -> Option<Vec<Estimate>> {
    let sizes = Sizes::fitted(context, readings, causes)?.with_moments(context, readings, causes);
    Some(sizes.of(context, causes, which))
}

/// Those of the set first, by their evidence, then by what they explain alone.
fn in_order(mut list: Vec<(f64, Candidate)>) -> Vec<Candidate> {
    list.sort_by(|a, b| {
        let by_set = b.1.in_set.cmp(&a.1.in_set);
        by_set.then(if a.1.in_set {
            b.1.evidence.total_cmp(&a.1.evidence)
        } else {
            b.0.total_cmp(&a.0)
        })
    });
    list.into_iter().map(|(_, c)| c).collect()
}

/// The variants of a named cause that fit as well: which sensor, which channel may be open where
/// the effect is not.
pub(crate) fn elsewhere(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    which: usize,
) -> Vec<Elsewhere> {
    let alike = variants_alike(context, readings, causes, which).into_iter();
    alike
        .filter_map(|(variant, trial)| {
            let sizes = Sizes::told(context, readings, &trial)?;
            let own = sizes.of(context, &trial, which);
            Some(Elsewhere {
                variant,
                parameters: own.into_iter().map(Into::into).collect(),
            })
        })
        .collect()
}

/// Those variants in words, with the causes of the fit in which the cause has them.
pub(crate) fn variants_alike(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    which: usize,
) -> Vec<(String, Vec<Cause>)> {
    let cause = &causes[which];
    let effect = &context.catalogue[cause.effect];
    let others = without(causes, which);
    let least = context.misfit(readings, causes);
    let mut starts: BTreeMap<usize, Shape> = BTreeMap::new();
    for shape in effect.grid(context.model) {
        starts.entry(shape.variant).or_insert(shape);
    }
    starts.remove(&cause.shape.variant);
    let beside = context.beside(context.model, readings, &others);
    let alike = |start: Shape| {
        let near = Shape {
            values: cause.shape.values.clone(),
            ..start.clone()
        };
        let fits = near.values.len() == near.steps.len() && effect.allowed(context.model, &near);
        let start = if fits { near } else { start };
        let (other, _) = beside.refine_alone(cause.effect, (&start, Reach::WIDE));
        // One that holds this variant fits as well whatever the readings are.
        if other.unknowns() > cause.unknowns() {
            return None;
        }
        let variant = effect.variant_name(context.model, &other.shape)?;
        if !possible(context, readings, &others, &other) {
            return None;
        }
        let mut trial = causes.to_vec();
        trial[which] = other;
        let close = context.misfit(readings, &trial) <= least + chi_squared_of_two(0.95);
        close.then_some((variant, trial))
    };
    starts.into_values().filter_map(alike).collect()
}
