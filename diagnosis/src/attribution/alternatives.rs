//! Which effects could stand in the place of one of several causes, the others kept.

use std::sync::Arc;

use errsep_models::model::Shape;
use nalgebra::DVector;
use rayon::prelude::*;

use crate::attribution::context::{Cause, Context};
use crate::attribution::limits::is_beyond_limit;
use crate::attribution::outweighed::{Member, drop_outweighed};
use crate::attribution::remainder::Remainder;
use crate::attribution::sizes::Sizes;
use crate::attribution::standing::{has_possible_sizes, possible, stands, without};
use crate::levels::{BETTER, EARNED, HOPELESS, HOPELESS_PART, IN_REACH, NEAR, chi_squared_of_two};
use crate::search::Reach;

/// An effect that explains the gap in the place of one of the causes.
pub(crate) struct Alternative {
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

/// The effects that are adequate in the place of cause `k` of the best causes, which leave `remainder`, the best fit
/// first; those are tried that explain less than it by no more than a part of what it does.
pub(super) fn alternatives(
    context: &Context<'_>,
    readings: &DVector<f64>,
    best: (&[Cause], &Arc<Remainder>),
    k: usize,
    part: f64,
) -> Vec<Member> {
    let replacement = Replacement::of(context, readings, best, k, part);
    let effects = (0..context.catalogue.len()).into_par_iter();
    let mut members: Vec<Member> = effects
        .filter_map(|effect| replacement.best_of(effect))
        .collect();
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

/// What may stand in the place of one of several causes.
struct Replacement<'s> {
    context: &'s Context<'s>,
    readings: &'s DVector<f64>,
    /// The causes, and what they leave.
    best: &'s [Cause],
    left: &'s Arc<Remainder>,
    k: usize,
    /// The other causes, and what they leave.
    others: Vec<Cause>,
    beside: Remainder,
    /// What the cause explains beside the others, and by how much another may explain less.
    own: f64,
    reach: f64,
    /// The misfit above which another is not refitted.
    hopeless: f64,
}

impl<'s> Replacement<'s> {
    fn of(
        context: &'s Context<'s>,
        readings: &'s DVector<f64>,
        (best, left): (&'s [Cause], &'s Arc<Remainder>),
        k: usize,
        part: f64,
    ) -> Self {
        let others = without(best, k);
        let beside = context.remainder(readings, &others);
        let misfit = context.misfit(readings, best);
        let own = beside.residual.norm_squared() - misfit;
        Self {
            context,
            readings,
            best,
            left,
            k,
            others,
            beside,
            own,
            reach: HOPELESS + part * own,
            hopeless: misfit + HOPELESS + HOPELESS_PART * own,
        }
    }

    /// What a cause explains beside the others.
    fn strength(&self, cause: &Cause) -> f64 {
        let mut all = self.others.clone();
        all.push(cause.clone());
        self.beside.residual.norm_squared() - self.context.misfit(self.readings, &all)
    }

    /// An effect as the cause, of greatest evidence of those in which it is adequate.
    fn best_of(&self, effect: usize) -> Option<Member> {
        if self.others.iter().any(|c| c.effect == effect) {
            return None;
        }
        let found = if effect == self.best[self.k].effect {
            self.relatives()
        } else {
            self.another(effect).into_iter().collect()
        };
        let refitted = found
            .into_par_iter()
            .filter_map(|cause| self.refitted(cause));
        let refitted: Vec<(f64, Vec<Cause>)> = refitted.collect();
        let mut distinct: Vec<(f64, Vec<Cause>)> = Vec::new();
        for (misfit, causes) in refitted {
            let same = |known: &(f64, Vec<Cause>)| {
                (known.0 - misfit).abs() < BETTER && in_same_variants(&known.1, &causes)
            };
            if !distinct.iter().any(same) {
                distinct.push((misfit, causes));
            }
        }
        let judged = distinct
            .into_par_iter()
            .filter_map(|(misfit, causes)| self.judged(misfit, causes));
        judged.max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }

    /// The cause, and its relatives, that a state bent by it may hide.
    fn relatives(&self) -> Vec<Cause> {
        let (context, cause) = (self.context, &self.best[self.k]);
        let relatives = context.catalogue[cause.effect].relatives(context.model, &cause.shape);
        let beside = context.beside(context.model, self.readings, &self.others);
        let other = |shape: Shape| {
            let here = context.cause(context.model, cause.effect, shape.clone());
            let near = here.columns.len() <= cause.columns.len()
                && self.strength(&here) > NEAR * self.own - HOPELESS;
            near.then(|| beside.refine_alone(cause.effect, (&shape, Reach::WIDE)).0)
        };
        let mut all = vec![cause.clone()];
        all.par_extend(relatives.into_par_iter().filter_map(other));
        all
    }

    /// Another effect in its place, where it stands out beside the others.
    fn another(&self, effect: usize) -> Option<Cause> {
        let context = self.context;
        if context.p_value(&self.beside, effect) > EARNED {
            return None;
        }
        let start = (context.start(&self.beside, effect)?, Reach::WIDE);
        let beside = context.beside(context.model, self.readings, &self.others);
        let found = beside.refine(effect, start);
        if self.strength(&found.0) < IN_REACH * self.own {
            return Some(found.0);
        }
        Some(beside.come_back(found).0)
    }

    /// The causes with another in the place, fitted with the state, and their misfit; nothing where it explains too
    /// little.
    fn refitted(&self, cause: Cause) -> Option<(f64, Vec<Cause>)> {
        let (context, readings) = (self.context, self.readings);
        if self.strength(&cause) < self.own - self.reach
            || !possible(context, readings, &self.others, &cause)
        {
            return None;
        }
        let known = is_same(&cause, &self.best[self.k]);
        let mut causes = self.others.clone();
        causes.insert(self.k, cause);
        if !known {
            causes = context.relinearised(readings, &causes, self.hopeless);
        }
        Some((context.misfit(readings, &causes), causes))
    }

    /// Causes as a member, where they leave nothing and the one in the place stands.
    fn judged(&self, misfit: f64, causes: Vec<Cause>) -> Option<Member> {
        let (context, readings, k) = (self.context, self.readings, self.k);
        let stands = has_possible_sizes(context, readings, &causes, k..k + 1)
            && Sizes::fitted(context, readings, &causes)
                .is_some_and(|sizes| stands(context, &causes, &sizes, k));
        if !stands {
            return None;
        }
        let known = causes.iter().zip(self.best).all(|(a, b)| is_same(a, b));
        let left = if known {
            Arc::clone(self.left)
        } else {
            Arc::new(context.judged(readings, &causes))
        };
        let passes =
            context.adequate(&causes, &left) && is_beyond_limit(context, readings, &causes, k);
        passes.then(|| Member {
            misfit,
            size: part_of_plausible(context, readings, &causes, k),
            evidence: evidence(context, readings, &causes, k, misfit),
            causes,
            left,
        })
    }
}

/// Whether a cause is the same in the same shape.
fn is_same(one: &Cause, other: &Cause) -> bool {
    one.effect == other.effect && one.shape == other.shape
}

/// Whether two ways to have the same effects have them in the same variants.
fn in_same_variants(one: &[Cause], other: &[Cause]) -> bool {
    let mut pairs = one.iter().zip(other);
    pairs.all(|(a, b)| a.shape.variant == b.shape.variant)
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
