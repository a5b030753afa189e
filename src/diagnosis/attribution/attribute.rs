//! Which effects: the search.
//!
//! One cause is tried first, then two, then three; each further one must earn its place beside the
//! others (`confidence.rs`). If no step forward succeeds, all pairs are tried.

use nalgebra::DVector;
use rayon::prelude::*;

use crate::diagnosis::attribution::confidence::{Answer, confidence_set, possible, without};
use crate::diagnosis::attribution::context::{Cause, Context, Remainder, finer};
use crate::diagnosis::levels::{
    BETTER, EARNED, HOPELESS, IN_REACH, MOST_CAUSES, NO_BETTER, PAIR_REACH, PAIRS, POLISHED,
    REFINED,
};

/// Seeks the causes of what stands out in readings; `begun` are those without which noise and state were had.
pub(in crate::diagnosis) fn attribute(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
    begun: &[Cause],
) -> Option<Answer> {
    let strongest_alone = strongest(context, readings, first, &[], 0.0);
    if let [only] = begun {
        let start = finer(&only.shape);
        let (cause, t) = context.refine(context.model, readings, only.effect, &start, &[]);
        let better = |(other, other_t): &(Cause, f64)| other.effect == only.effect && *other_t > t;
        if !strongest_alone.as_ref().is_some_and(better) {
            let answer = confidence_set(context, readings, &[cause]);
            if answer.complete {
                return Some(answer);
            }
        }
    }
    let mut causes: Vec<Cause> = Vec::new();
    let mut partial: Option<Answer> = None;
    for size in 1..=MOST_CAUSES {
        let here = partial.as_ref().map_or(first, |answer| &answer.remainder);
        let next = match size {
            1 => strongest_alone.clone(),
            _ => strongest(context, readings, here, &causes, 0.0),
        };
        let Some((next, _)) = next else {
            break;
        };
        causes.push(next);
        if size > 1 {
            polish(context, readings, &mut causes);
        }
        let answer = confidence_set(context, readings, &causes);
        if answer.complete {
            return Some(answer);
        }
        // Causes that have come to coincide cannot be fitted together: those before stand.
        if context.amplitudes(readings, &answer.causes).is_none() {
            break;
        }
        causes.clone_from(&answer.causes);
        partial = Some(answer);
    }
    let judged = partial.as_ref().map_or(f64::INFINITY, |answer| {
        answer.remainder.residual.norm_squared()
    });
    let least = judged + HOPELESS;
    pairs(context, readings, first)
        .into_iter()
        .filter(|causes| {
            let known = partial.as_ref().is_some_and(|a| same(&a.causes, causes));
            !known || context.misfit(readings, causes) < judged - NO_BETTER
        })
        .filter(|causes| {
            context.misfit(readings, &context.relinearised(readings, causes, least)) < least
        })
        .map(|causes| confidence_set(context, readings, &causes))
        .find(|answer| answer.complete)
        .or(partial)
}

/// The causes without which noise and state cannot be had: by strength, each refitted, no others
/// tried in their place.
pub(in crate::diagnosis) fn roughly(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
) -> Vec<Cause> {
    let mut causes: Vec<Cause> = Vec::new();
    let mut left: Option<Remainder> = None;
    for _ in 0..MOST_CAUSES {
        let here = left.as_ref().unwrap_or(first);
        let Some((next, _)) = strongest(context, readings, here, &causes, 0.0) else {
            break;
        };
        causes.push(next);
        if causes.len() > 1 {
            polish(context, readings, &mut causes);
        }
        causes = context.relinearised(readings, &causes, f64::INFINITY);
        let remainder = context.judged(readings, &causes);
        if context.adequate(&causes, &remainder) {
            break;
        }
        left = Some(remainder);
    }
    causes
}

/// Pairs of effects of which each stands out beside the other though neither need do so alone, the
/// best fits first.
fn pairs(context: &Context<'_>, readings: &DVector<f64>, first: &Remainder) -> Vec<Vec<Cause>> {
    let beside_each = |effect: usize| {
        let mut found: Vec<(f64, Vec<Cause>)> = Vec::new();
        let Some(start) = context.start(first, effect) else {
            return found;
        };
        let one = vec![context.cause(context.model, effect, start.clone())];
        let beside = context.remainder(readings, &one);
        for other in effect + 1..context.catalogue.len() {
            if context.p_value(&beside, other) > EARNED {
                continue;
            }
            let Some(start) = context.start(&beside, other) else {
                continue;
            };
            let second = context.cause(context.model, other, start.clone());
            let pair = vec![one[0].clone(), second];
            found.push((context.misfit(readings, &pair), pair));
        }
        found
    };
    let effects = (0..context.catalogue.len()).into_par_iter();
    let mut found: Vec<(f64, Vec<Cause>)> = effects.flat_map_iter(beside_each).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Coarse fits further above the best than this cannot become the best by refining.
    let reach = found.first().map_or(0.0, |(least, _)| PAIR_REACH * least);
    found.retain(|(misfit, _)| *misfit <= reach);
    found.truncate(PAIRS);
    let polished = found.into_par_iter().map(|(_, mut pair)| {
        polish(context, readings, &mut pair);
        (context.misfit(readings, &pair), pair)
    });
    let mut polished: Vec<(f64, Vec<Cause>)> = polished.collect();
    polished.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut distinct: Vec<Vec<Cause>> = Vec::new();
    for (_, pair) in polished {
        // Begun elsewhere, the search may have come to the same.
        if !distinct.iter().any(|known| same(known, &pair)) {
            distinct.push(pair);
        }
    }
    distinct
}

/// Whether causes are the same effects in the same variants.
fn same(one: &[Cause], other: &[Cause]) -> bool {
    let holds = |c: &Cause| {
        let mut all = other.iter();
        all.any(|o| o.effect == c.effect && o.shape.variant == c.shape.variant)
    };
    one.len() == other.len() && one.iter().all(holds)
}

/// The refined effect with the greatest statistic beside the causes, and that statistic. `known`: one that
/// another cause has there already.
fn strongest(
    context: &Context<'_>,
    readings: &DVector<f64>,
    remainder: &Remainder,
    causes: &[Cause],
    known: f64,
) -> Option<(Cause, f64)> {
    let mut ranked: Vec<(f64, usize)> = (0..context.catalogue.len())
        .filter(|effect| causes.iter().all(|c| c.effect != *effect))
        .filter(|effect| context.p_value(remainder, *effect) < EARNED)
        .filter_map(|effect| {
            let family = context.family_of(effect)?;
            Some((context.best(remainder, family).0, effect))
        })
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.truncate(REFINED);
    let refined: Vec<(Cause, f64)> = ranked
        .into_par_iter()
        .filter_map(|(_, effect)| {
            let start = context.start(remainder, effect)?;
            Some(context.refine(context.model, readings, effect, start, causes))
        })
        .collect();
    let best = refined.iter().map(|(_, t)| *t).fold(known, f64::max);
    refined
        .into_iter()
        .map(|found| {
            if found.1 < IN_REACH * best {
                return found;
            }
            context.come_back(context.model, readings, found, causes)
        })
        .filter(|(cause, _)| possible(context, readings, causes, cause))
        .max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Refines each cause beside the others, and swaps it for any effect that explains more, itself
/// begun elsewhere among them; not again where the others leave what they left before.
fn polish(context: &Context<'_>, readings: &DVector<f64>, causes: &mut [Cause]) {
    let mut tried: Vec<f64> = vec![f64::INFINITY; causes.len()];
    for _ in 0..POLISHED {
        let mut changed = false;
        for k in 0..causes.len() {
            let others = without(causes, k);
            let start = finer(&causes[k].shape);
            let (refined, t) =
                context.refine(context.model, readings, causes[k].effect, &start, &others);
            let left = context.misfit(readings, &others);
            let again = (left - tried[k]).abs() > NO_BETTER;
            let swapped = again.then(|| {
                tried[k] = left;
                let remainder = context.remainder(readings, &others);
                let strongest = strongest(context, readings, &remainder, &others, t);
                strongest.map(|(c, _)| {
                    context.refine(context.model, readings, c.effect, &finer(&c.shape), &others)
                })
            });
            match swapped.flatten() {
                Some((other, other_t)) if other_t > t + BETTER => {
                    causes[k] = other;
                    changed = true;
                }
                _ => {
                    changed |= refined.shape.values != causes[k].shape.values;
                    causes[k] = refined;
                }
            }
        }
        if !changed {
            break;
        }
    }
}
