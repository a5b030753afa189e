//! Which effects: the search.
//!
//! One cause is tried first, then two, then three; each further one must earn its place beside the
//! others (`confidence.rs`). If no step forward succeeds, all pairs are tried, and then up to six causes as
//! long as each takes a good part of what is left away.

use errsep_models::model::Shape;
use nalgebra::DVector;
use rayon::prelude::*;

use crate::attribution::confidence::{Answer, confidence_set};
use crate::attribution::context::{Cause, Context};
use crate::attribution::fewer::in_fewest;
use crate::attribution::refine::Beside;
use crate::attribution::remainder::Remainder;
use crate::attribution::standing::{possible, without};
use crate::levels::{
    BETTER, EARNED, FAR, FREELY, HOPELESS, IN_REACH, MOST_CAUSES, NO_BETTER, PAIR_REACH, PAIRS,
    POLISHED, REFINED, STALLED,
};
use crate::search::Reach;

/// Seeks the causes of what stands out in readings; `begun` are those without which noise and state were had.
pub(crate) fn attribute(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
    begun: &[Cause],
) -> Option<Answer> {
    let strongest_alone = strongest(context, readings, first, (&[], begun));
    if let [only] = begun {
        let start = (&only.shape, Reach::NEAR);
        let beside = context.beside(context.model, readings, &[]);
        let (cause, t) = beside.refine(only.effect, start);
        let better = |(other, other_t): &(Cause, f64)| other.effect == only.effect && *other_t > t;
        if !strongest_alone.as_ref().is_some_and(better) {
            let answer = confidence_set(context, readings, &[cause]);
            if answer.complete {
                return Some(answer);
            }
        }
    }
    let mut search = Search {
        context,
        readings,
        first,
        begun,
        partial: None,
        stalled: false,
    };
    search
        .forward(strongest_alone, 1..=FREELY)
        .or_else(|| search.by_pairs())
        .or_else(|| search.forward(None, FREELY + 1..=MOST_CAUSES))
        .map(|answer| in_fewest(context, readings, answer))
        .or(search.partial)
}

/// A search with the best that it has come to.
struct Search<'s> {
    context: &'s Context<'s>,
    readings: &'s DVector<f64>,
    first: &'s Remainder,
    begun: &'s [Cause],
    partial: Option<Answer>,
    /// Whether the last cause left most of what was there.
    stalled: bool,
}

impl Search<'_> {
    /// One cause more at a time, until what is left is adequate. Where much is left a third and more are
    /// sought only as long as the last took a good part away: what only imitates is not built upon.
    fn forward(
        &mut self,
        strongest_alone: Option<(Cause, f64)>,
        sizes: std::ops::RangeInclusive<usize>,
    ) -> Option<Answer> {
        let (context, readings) = (self.context, self.readings);
        let mut alone = strongest_alone;
        for size in sizes {
            let partial = self.partial.as_ref();
            let mut causes = partial.map_or_else(Vec::new, |answer| answer.causes.clone());
            if causes.len() + 1 != size || self.stalled {
                break;
            }
            let here = partial.map_or(self.first, |answer| &answer.remainder);
            let next = match size {
                1 => alone.take(),
                _ => strongest(context, readings, here, (&causes, self.begun)),
            };
            let Some((next, _)) = next else {
                break;
            };
            causes.push(next);
            if size > 1 {
                polish(context, readings, &mut causes, self.begun);
            }
            let answer = confidence_set(context, readings, &causes);
            if answer.complete {
                return Some(answer);
            }
            if let Some(fewer) = self.spared(&answer) {
                return Some(fewer);
            }
            // Causes that have come to coincide cannot be fitted together: those before stand.
            if context.amplitudes(readings, &answer.causes).is_none() {
                break;
            }
            let before = partial.map(|before| self.excess(before));
            let left = self.excess(&answer);
            self.partial = Some(answer);
            let far = FAR * (2.0 * context.space.degrees_of_freedom() as f64).sqrt();
            self.stalled = left > far && before.is_some_and(|before| left > STALLED * before);
        }
        None
    }

    /// What is left beyond the noise.
    fn excess(&self, answer: &Answer) -> f64 {
        answer.remainder.square - self.context.space.degrees_of_freedom() as f64
    }

    /// Pairs of which neither need stand out alone.
    fn by_pairs(&self) -> Option<Answer> {
        let (context, readings) = (self.context, self.readings);
        let partial = self.partial.as_ref();
        let judged = partial.map_or(f64::INFINITY, |answer| {
            answer.remainder.residual.norm_squared()
        });
        let least = judged + HOPELESS;
        pairs(context, readings, self.first, self.begun)
            .into_iter()
            .filter(|causes| {
                let known = partial.is_some_and(|a| same(&a.causes, causes));
                !known || context.misfit(readings, causes) < judged - NO_BETTER
            })
            .filter(|causes| {
                context.misfit(readings, &context.relinearised(readings, causes, least)) < least
            })
            .find_map(|causes| {
                let answer = confidence_set(context, readings, &causes);
                if answer.complete {
                    return Some(answer);
                }
                self.spared(&answer)
            })
    }

    /// The answer of one cause less, where several leave nothing and that one is not needed: beside it another may have been
    /// found that was hidden by what it does to the state. Of three and more each may be such a one, once the state is
    /// fitted without it.
    fn spared(&self, answer: &Answer) -> Option<Answer> {
        let (context, readings) = (self.context, self.readings);
        let count = answer.causes.len();
        if count < 2 || !context.adequate(&answer.causes, &answer.remainder) {
            return None;
        }
        let judged = self.partial.as_ref();
        let most = answer.remainder.residual.norm_squared() + HOPELESS;
        let mut fewer: Vec<(f64, Vec<Cause>)> = (0..count)
            .map(|k| {
                let fewer = without(&answer.causes, k);
                let beside = context.remainder(readings, &fewer);
                (context.p_value(&beside, answer.causes[k].effect), fewer)
            })
            .filter(|(p_value, _)| *p_value > EARNED || count > 2)
            .filter(|(_, fewer)| !judged.is_some_and(|judged| same(&judged.causes, fewer)))
            .collect();
        fewer.sort_by(|a, b| b.0.total_cmp(&a.0));
        fewer.into_iter().find_map(|(p_value, fewer)| {
            let needed = p_value <= EARNED;
            if needed {
                let fitted = context.relinearised(readings, &fewer, most);
                if context.misfit(readings, &fitted) > most {
                    return None;
                }
            }
            let found = confidence_set(context, readings, &fewer);
            if found.complete && found.remainder.residual.norm_squared() < most {
                return Some(found);
            }
            if needed || fewer.len() < 2 {
                return None;
            }
            self.spared(&found)
        })
    }
}

/// The causes without which noise and state cannot be had: by strength, each refitted, no others
/// tried in their place.
pub(crate) fn roughly(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
) -> Vec<Cause> {
    let mut causes: Vec<Cause> = Vec::new();
    let mut left: Option<Remainder> = None;
    for _ in 0..FREELY {
        let here = left.as_ref().unwrap_or(first);
        let Some((next, _)) = strongest(context, readings, here, (&causes, &[])) else {
            break;
        };
        causes.push(next);
        if causes.len() > 1 {
            polish(context, readings, &mut causes, &[]);
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
fn pairs(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
    begun: &[Cause],
) -> Vec<Vec<Cause>> {
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
        polish(context, readings, &mut pair, begun);
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

/// The refined effect of greatest evidence beside the causes, and its statistic; sought from where those begun with
/// stand too.
fn strongest(
    context: &Context<'_>,
    readings: &DVector<f64>,
    remainder: &Remainder,
    (causes, begun): (&[Cause], &[Cause]),
) -> Option<(Cause, f64)> {
    let beside = context.beside(context.model, readings, causes);
    let refined = standing_out(context, &beside, remainder, (causes, begun));
    greatest(context, readings, (&beside, causes), refined, 0.0)
}

/// The effects that stand out most beside the causes, refined, and those that were begun with: from the best entry of
/// the family, and from where they stood. What follows the readings may find its way from there alone.
fn standing_out(
    context: &Context<'_>,
    beside: &Beside<'_>,
    remainder: &Remainder,
    (causes, begun): (&[Cause], &[Cause]),
) -> Vec<(Cause, f64)> {
    let mut ranked: Vec<(f64, usize)> = (0..context.catalogue.len())
        .filter(|effect| causes.iter().all(|c| c.effect != *effect))
        .filter(|effect| context.p_value(remainder, *effect) < EARNED)
        .filter_map(|effect| {
            let family = context.family_of(effect)?;
            Some((context.best(remainder, family).0, effect))
        })
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let known = |effect: usize| begun.iter().find(|cause| cause.effect == effect);
    let sought: Vec<usize> = (ranked.iter().enumerate())
        .filter(|(rank, (_, effect))| *rank < REFINED || known(*effect).is_some())
        .map(|(_, (_, effect))| *effect)
        .collect();
    sought
        .into_par_iter()
        .filter_map(|effect| {
            let refine = |start: (&Shape, Reach)| beside.refine(effect, start);
            let (found, again) = rayon::join(
                || {
                    let start = context.start(remainder, effect)?;
                    Some(refine((start, Reach::WIDE)))
                },
                || known(effect).map(|cause| refine((&cause.shape, Reach::NEAR))),
            );
            let both = found.into_iter().chain(again);
            both.max_by(|a, b| paid(context, a).total_cmp(&paid(context, b)))
        })
        .collect()
}

/// Of effects refined beside the causes that of greatest evidence. `known`: a statistic that another cause has there
/// already.
fn greatest(
    context: &Context<'_>,
    readings: &DVector<f64>,
    (beside, causes): (&Beside<'_>, &[Cause]),
    refined: Vec<(Cause, f64)>,
    known: f64,
) -> Option<(Cause, f64)> {
    let best = refined.iter().map(|(_, t)| *t).fold(known, f64::max);
    let settled: Vec<(Cause, f64)> = refined
        .into_par_iter()
        .map(|found| {
            if found.1 < IN_REACH * best {
                return found;
            }
            beside.come_back(found)
        })
        .collect();
    settled
        .into_iter()
        .filter(|(cause, _)| possible(context, readings, causes, cause))
        .max_by(|a, b| paid(context, a).total_cmp(&paid(context, b)))
}

/// A statistic less what the unknowns cost it: twice Schwarz's evidence.
fn paid(context: &Context<'_>, (cause, t): &(Cause, f64)) -> f64 {
    t - cause.unknowns() as f64 * (context.space.readings() as f64).ln()
}

/// Refines each cause beside the others, and swaps it for any effect that explains more, itself
/// begun elsewhere among them; not again where the others leave what they left before.
fn polish(context: &Context<'_>, readings: &DVector<f64>, causes: &mut [Cause], begun: &[Cause]) {
    let mut tried: Vec<f64> = vec![f64::INFINITY; causes.len()];
    for _ in 0..POLISHED {
        let mut changed = false;
        for k in 0..causes.len() {
            let others = without(causes, k);
            let left = context.misfit(readings, &others);
            let again = (left - tried[k]).abs() > NO_BETTER;
            let beside = context.beside(context.model, readings, &others);
            let refine = |effect: usize, start: &Shape| beside.refine(effect, (start, Reach::NEAR));
            let (refined, found) = rayon::join(
                || refine(causes[k].effect, &causes[k].shape),
                || {
                    again.then(|| {
                        let remainder = context.remainder(readings, &others);
                        standing_out(context, &beside, &remainder, (&others, begun))
                    })
                },
            );
            let swapped = found.map(|found| {
                tried[k] = left;
                let strongest = greatest(context, readings, (&beside, &others), found, refined.1);
                strongest.map(|(c, _)| refine(c.effect, &c.shape))
            });
            match swapped.flatten() {
                Some(other) if paid(context, &other) > paid(context, &refined) + BETTER => {
                    causes[k] = other.0;
                    changed = true;
                }
                _ => {
                    changed |= refined.0.shape.values != causes[k].shape.values;
                    causes[k] = refined.0;
                }
            }
        }
        if !changed {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use errsep_models::model::{AnyModel, FittedModel};
    use errsep_models::reversal::Channel;
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Injection, Scene, SceneNoise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::{Search, confidence_set};
    use crate::attribution::context::Context;
    use crate::detection::estimate::estimate;

    /// *Simulated truth*, of one seed: of three causes that leave nothing, one of them not needed, the two that are there
    /// are the answer.
    #[test]
    fn what_is_not_needed_of_three_is_left_out() {
        let noise = SceneNoise {
            white: 0.1,
            ..SceneNoise::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut scene = Scene::random(60, 4, 1e-5, 2.0, noise, &mut random);
        scene.effects = vec![
            Injection::ZeroJump {
                jump: 1.0,
                channel: Channel::C1A,
                time: 20.0,
            },
            Injection::ReversalShift(2.0),
        ];
        let fitted = Linearised::new(&scene.measured(5), Assumptions::default()).unwrap();
        let model = AnyModel::new(&fitted);
        let catalogue = model.effects();
        let readings = model.linearised();
        let context = Context::new(&model, &catalogue, estimate(&model, &readings), 100, 1);
        let first = context.remainder(&readings, &[]);
        let of = |name: &str| {
            let effect = catalogue.iter().position(|e| e.name() == name).unwrap();
            let start = context.start(&first, effect).unwrap().clone();
            context.cause(&model, effect, start)
        };
        let causes = ["zero-jump", "reversal-shift", "local-contamination"].map(of);
        let all = confidence_set(&context, &readings, &causes);
        assert!(!all.complete && all.causes.len() == 3);
        let search = Search {
            context: &context,
            readings: &readings,
            first: &first,
            begun: &[],
            partial: None,
            stalled: false,
        };
        let fewer = search.spared(&all).expect("two that pass");
        let mut names: Vec<&str> = fewer
            .causes
            .iter()
            .map(|c| catalogue[c.effect].name())
            .collect();
        names.sort_unstable();
        assert_eq!(names, ["reversal-shift", "zero-jump"]);
    }
}
