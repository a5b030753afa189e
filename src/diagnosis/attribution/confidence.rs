//! Which effect: a confidence set, not a winner.
//!
//! A cause is accepted when, refitted with everything else free, it leaves nothing that stands out
//! of the noise: no other effect, no place. All causes that pass are the confidence set (the
//! inversion of the test); significance alone names nothing. Of several each must earn its place.

use std::ops::Range;

use errsep_models::model::Shape;
use nalgebra::DVector;
use rayon::prelude::*;

use crate::diagnosis::attribution::context::{Cause, Context, Remainder, raw_signatures};
use crate::diagnosis::attribution::leading::led;
use crate::diagnosis::attribution::limits::is_beyond_limit;
use crate::diagnosis::attribution::outweighed::{Member, drop_outweighed};
use crate::diagnosis::attribution::shrink::held_out_square;
use crate::diagnosis::attribution::sizes::{Sizes, first_amplitude};
use crate::diagnosis::detection::space::{Space, orthonormal};
use crate::diagnosis::levels::{
    BENT, EARNED, HOPELESS, HOPELESS_PART, IN_REACH, NEAR, STANDS, WEIGHTY, chi_squared_of_two,
};
use crate::diagnosis::noise::law::{NoiseLaw, NoiseSource};

/// An effect that explains the gap in the place of one of the causes.
pub(in crate::diagnosis) struct Alternative {
    /// The cause, the others beside it.
    pub cause: Cause,
    /// Logarithm of the evidence for it against nothing in its place (Schwarz's approximation).
    pub evidence: f64,
}

/// Causes that together explain the gap, and those that do it as well.
pub(in crate::diagnosis) struct Answer {
    /// The causes, by what each adds.
    pub causes: Vec<Cause>,
    /// For each cause the effects that these data cannot tell from it and itself, the cause first: it
    /// has the greatest evidence, unless those of greatest evidence do not pass together.
    pub groups: Vec<Vec<Alternative>>,
    /// What remains beside them.
    pub remainder: Remainder,
    /// Whether the remainder is adequate.
    pub complete: bool,
}

/// All effects that could stand in place of each cause, the others kept.
pub(in crate::diagnosis) fn confidence_set(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
) -> Answer {
    let mut best = context.relinearised(readings, causes, f64::INFINITY);
    let mut remainder = context.judged(readings, &best);
    let mut groups = Vec::new();
    for k in 0..causes.len() {
        let mut members = alternatives(context, readings, &best, k, HOPELESS_PART);
        if members.is_empty() && causes.len() == 1 {
            // What bends the state most is seen least at that state.
            let least = context.misfit(readings, &best);
            members = alternatives(context, readings, &best, k, BENT);
            members.retain(|m| m.left.residual.norm_squared() < least);
        }
        let mut group = group_of(&members, k);
        if let Some(first) = members.into_iter().next() {
            best = first.causes;
            remainder = first.left;
        } else {
            let misfit = context.misfit(readings, &best);
            group.push(Alternative {
                cause: best[k].clone(),
                evidence: evidence(context, readings, &best, k, misfit),
            });
        }
        groups.push(group);
    }
    let answer = Answer {
        causes: best,
        groups,
        remainder,
        complete: false,
    };
    led(context, readings, answer)
}

/// The effects that pass in the place of each of some causes, itself first.
pub(in crate::diagnosis) fn groups_beside(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
) -> Vec<Vec<Alternative>> {
    let beside = |k: usize| {
        let members = alternatives(context, readings, causes, k, HOPELESS_PART);
        let mut group = group_of(&members, k);
        if group.iter().all(|a| a.cause.effect != causes[k].effect) {
            let misfit = context.misfit(readings, causes);
            group.push(Alternative {
                cause: causes[k].clone(),
                evidence: evidence(context, readings, causes, k, misfit),
            });
        }
        group.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        group.sort_by_key(|a| a.cause.effect != causes[k].effect);
        group
    };
    (0..causes.len()).map(beside).collect()
}

fn group_of(members: &[Member], k: usize) -> Vec<Alternative> {
    let of = |m: &Member| Alternative {
        cause: m.causes[k].clone(),
        evidence: m.evidence,
    };
    members.iter().map(of).collect()
}

/// Whether each of some causes is needed beside the others, is no other effect at its limit, and has a size
/// that is possible.
pub(in crate::diagnosis) fn stand_together(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
) -> bool {
    let needed = causes.len() == 1
        || weighty(context, readings, causes)
            && (0..causes.len()).all(|k| {
                let beside = context.remainder(readings, &without(causes, k));
                context.p_value(&beside, causes[k].effect) < EARNED
            })
            && predicts(context, readings, causes);
    needed
        && has_possible_sizes(context, readings, causes, 0..causes.len())
        && (0..causes.len()).all(|k| is_beyond_limit(context, readings, causes, k))
        && sized(context, readings, causes)
}

/// Whether of every cause one size at least is beyond its standard uncertainty, of several causes
/// beyond twice that, the state's included: what may as well be nothing stands for something that it
/// only imitates.
fn sized(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> bool {
    let all = |sizes: Sizes| (0..causes.len()).all(|k| stands(context, causes, &sizes, k));
    // Without the state it is seen sooner.
    Sizes::fitted(context, readings, causes).is_some_and(all)
        && Sizes::fitted_with_state(context, readings, causes).is_some_and(all)
}

/// Whether one of the sizes that are told of a cause is known to better than itself.
fn stands(context: &Context<'_>, causes: &[Cause], sizes: &Sizes, which: usize) -> bool {
    let shapes = context.catalogue[causes[which].effect].shape_parameters();
    let own = sizes.of(context, causes, which);
    let least = STANDS[usize::from(causes.len() > 1)];
    own.iter()
        .filter(|estimate| shapes.iter().all(|p| p.name != estimate.name))
        .any(|estimate| estimate.value.abs() > least * estimate.std)
}

/// Whether each of several causes, beside the others, changes the readings by more than may be left
/// of the strongest of them because its signature is not quite that of the true cause. Counted in
/// the readings' own unit, as signatures differ, and not by the noise, under which a slow change
/// shows less; of the strongest all that shows, as that is what a wrong signature errs by.
fn weighty(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> bool {
    let Some(changes) = context.changes(readings, causes) else {
        return false;
    };
    let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
    let shown = Space::new(context.model, &unit).forward(changes).0;
    let sizes: Vec<f64> = shown.column_iter().map(|c| c.norm()).collect();
    let own: Vec<f64> = (0..causes.len())
        .map(|k| {
            let mut others = sizes.clone();
            others.remove(k);
            let basis = orthonormal(&shown.clone().remove_column(k), &others);
            let change = shown.column(k);
            (change - &basis * basis.tr_mul(&change)).norm_squared()
        })
        .collect();
    let most = sizes.iter().map(|size| size * size).fold(0.0, f64::max);
    own.iter().all(|square| *square > WEIGHTY * most)
}

/// Whether each of several causes makes the prediction of held-out repeats better; a cause that
/// happened once cannot be judged so.
fn predicts(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> bool {
    let square = |causes: &[Cause]| {
        let signatures = raw_signatures(context, causes);
        held_out_square(context.model, readings, &signatures)
    };
    let Some(with) = square(causes) else {
        return true;
    };
    (0..causes.len()).all(|k| square(&without(causes, k)).is_none_or(|s| s > with))
}

/// The effects that are adequate in the place of cause `k`, the best fit first; those are tried that explain
/// less than it by no more than a part of what it does.
fn alternatives(
    context: &Context<'_>,
    readings: &DVector<f64>,
    best: &[Cause],
    k: usize,
    part: f64,
) -> Vec<Member> {
    let others = without(best, k);
    let remainder = context.remainder(readings, &others);
    let strength = |cause: &Cause| {
        let mut all = others.clone();
        all.push(cause.clone());
        remainder.residual.norm_squared() - context.misfit(readings, &all)
    };
    let own = strength(&best[k]);
    let reach = HOPELESS + part * own;
    let least = context.misfit(readings, best) + HOPELESS + HOPELESS_PART * own;
    let best_of = |effect: usize| -> Option<Member> {
        if others.iter().any(|c| c.effect == effect) {
            return None;
        }
        let trials = if effect == best[k].effect {
            // Relatives that a state bent by the first may hide.
            let relatives = context.catalogue[effect].relatives(context.model, &best[k].shape);
            let columns = best[k].columns.len();
            let other = |shape: Shape| {
                let here = context.cause(context.model, effect, shape.clone());
                let near = here.columns.len() <= columns && strength(&here) > NEAR * own - HOPELESS;
                near.then(|| context.refine_alone(context.model, readings, effect, &shape, &others))
            };
            let mut own = vec![Some(best[k].clone())];
            own.par_extend(relatives.into_par_iter().map(other));
            own
        } else {
            if context.p_value(&remainder, effect) > EARNED {
                return None;
            }
            let start = context.start(&remainder, effect);
            vec![start.map(|start| {
                let found = context.refine(context.model, readings, effect, start, &others);
                if strength(&found.0) < IN_REACH * own {
                    return found.0;
                }
                let (cause, _) = context.come_back(context.model, readings, found, &others);
                cause
            })]
        };
        let judged = trials.into_par_iter().flatten().filter_map(|cause| {
            if strength(&cause) < own - reach || !possible(context, readings, &others, &cause) {
                return None;
            }
            let known = cause.shape == best[k].shape && effect == best[k].effect;
            let mut trial = others.clone();
            trial.insert(k, cause);
            let trial = if known {
                trial
            } else {
                context.relinearised(readings, &trial, least)
            };
            let left = context.judged(readings, &trial);
            let misfit = left.square;
            let passes = has_possible_sizes(context, readings, &trial, k..k + 1)
                && context.adequate(&trial, &left)
                && is_beyond_limit(context, readings, &trial, k)
                && Sizes::fitted(context, readings, &trial)
                    .is_some_and(|sizes| stands(context, &trial, &sizes, k));
            passes.then(|| Member {
                misfit,
                size: part_of_plausible(context, readings, &trial, k),
                evidence: evidence(context, readings, &trial, k, misfit),
                causes: trial,
                left,
            })
        });
        judged.max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    };
    let effects = (0..context.catalogue.len()).into_par_iter();
    let mut members: Vec<Member> = effects.filter_map(best_of).collect();
    drop_outweighed(context, &mut members, k);
    let least = members
        .iter()
        .map(|m| m.misfit)
        .fold(f64::INFINITY, f64::min);
    members.sort_by(|a, b| {
        // Of those that fit equally well beside others the one of more usual size is kept.
        let behind = |m: &Member| m.misfit > least + chi_squared_of_two(0.99);
        let by_fit = a.misfit.total_cmp(&b.misfit);
        let by_size = a.size.total_cmp(&b.size);
        behind(a).cmp(&behind(b)).then(if behind(a) {
            by_fit
        } else {
            by_size.then(by_fit)
        })
    });
    members
}

/// Logarithm of the evidence for cause `k` beside the others against nothing in its place, by the
/// misfit that all of them leave (Schwarz, Ann. Statist. 6 (1978) 461).
fn evidence(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    k: usize,
    misfit: f64,
) -> f64 {
    let beside = context.misfit(readings, &without(causes, k));
    let unknowns = causes[k].unknowns() as f64;
    0.5 * (beside - misfit - unknowns * (context.space.readings() as f64).ln())
}

/// The greatest amplitude of a cause as a part of the plausible one.
fn part_of_plausible(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    k: usize,
) -> f64 {
    let Some((amplitudes, _)) = context.amplitudes(readings, causes) else {
        return f64::INFINITY;
    };
    let from: usize = causes[..k].iter().map(|c| c.projected.ncols()).sum();
    context.catalogue[causes[k].effect]
        .amplitudes_at(&causes[k].shape)
        .iter()
        .zip(amplitudes.iter().skip(from))
        .map(|(p, a)| a.abs() / p.low.abs().max(p.high.abs()))
        .fold(0.0, f64::max)
}

/// Whether a cause beside others has a physically possible size.
pub(in crate::diagnosis) fn possible(
    context: &Context<'_>,
    readings: &DVector<f64>,
    others: &[Cause],
    cause: &Cause,
) -> bool {
    let mut all = others.to_vec();
    all.push(cause.clone());
    has_possible_sizes(context, readings, &all, others.len()..all.len())
}

/// Whether some of several causes, all fitted together, have physically possible sizes.
pub(in crate::diagnosis) fn has_possible_sizes(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    mut which: Range<usize>,
) -> bool {
    let Some((amplitudes, covariance)) = context.amplitudes(readings, causes) else {
        return false;
    };
    let stds = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    which.all(|k| {
        let cause = &causes[k];
        let from = first_amplitude(causes, k);
        let own = from..from + cause.projected.ncols();
        context.plausible(
            cause.effect,
            &cause.shape,
            &amplitudes.as_slice()[own.clone()],
            &stds.as_slice()[own],
        )
    })
}

/// The causes but one.
pub(in crate::diagnosis) fn without(causes: &[Cause], k: usize) -> Vec<Cause> {
    let mut others = causes.to_vec();
    others.remove(k);
    others
}
