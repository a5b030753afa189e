//! Which effects could stand in the place of one of several causes, the others kept.

use errsep_models::model::Shape;
use nalgebra::DVector;
use rayon::prelude::*;

use crate::diagnosis::attribution::context::{Cause, Context};
use crate::diagnosis::attribution::limits::is_beyond_limit;
use crate::diagnosis::attribution::outweighed::{Member, drop_outweighed};
use crate::diagnosis::attribution::sizes::Sizes;
use crate::diagnosis::attribution::standing::{has_possible_sizes, possible, stands, without};
use crate::diagnosis::levels::{
    EARNED, HOPELESS, HOPELESS_PART, IN_REACH, NEAR, chi_squared_of_two,
};

/// An effect that explains the gap in the place of one of the causes.
pub(in crate::diagnosis) struct Alternative {
    /// The cause, the others beside it.
    pub cause: Cause,
    /// Logarithm of the evidence for it against nothing in its place (Schwarz's approximation).
    pub evidence: f64,
}

pub(super) fn group_of(members: &[Member], k: usize) -> Vec<Alternative> {
    let of = |m: &Member| Alternative {
        cause: m.causes[k].clone(),
        evidence: m.evidence,
    };
    members.iter().map(of).collect()
}

/// The effects that are adequate in the place of cause `k`, the best fit first; those are tried that explain
/// less than it by no more than a part of what it does.
pub(super) fn alternatives(
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
pub(super) fn evidence(
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
