//! The score stage: what the diagnosis would name in readings that hold a rival, by the signatures, the
//! null law and the levels of the diagnosis itself.
//!
//! All rivals of a batch are scored at once; only those in which the name stands first go on to be
//! refined and judged. State and noise stay those of the diagnosis, which makes both anew.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::attribution::confidence::Answer;
use crate::attribution::context::{Cause, Context};
use crate::attribution::doubt::FEW_DRAWS;
use crate::attribution::outweighed::{holds, outweighed};
use crate::attribution::remainder::Remainder;
use crate::attribution::standing::possible;
use crate::detection::dictionary::Dictionary;
use crate::detection::folding::Sums;
use crate::detection::null::{BATCH, add_surprises, seen};
use crate::levels::{EARNED, REFINED, UNSEARCHED};
use crate::search::Reach;
use crate::severity::rivals::Drawn;

/// A name that was given.
pub(crate) struct Name {
    /// The effect, of a group the first.
    pub effect: String,
    /// All effects of its group by their places in the catalogue.
    pub members: Vec<usize>,
    /// Visible length of what it changes, in standard deviations of the noise.
    pub size: f64,
    /// Probability at which a gap is detected.
    pub false_alarm: f64,
}

impl Name {
    /// The names of an answer.
    pub fn all(
        context: &Context<'_>,
        readings: &DVector<f64>,
        answer: &Answer,
        false_alarm: f64,
    ) -> Vec<Self> {
        let Some((amplitudes, _)) = context.amplitudes(readings, &answer.causes) else {
            return Vec::new();
        };
        let mut from = 0;
        let causes = answer.causes.iter().zip(&answer.groups);
        causes
            .map(|(cause, group)| {
                let own = amplitudes.rows(from, cause.projected.ncols());
                from += cause.projected.ncols();
                let mut members: Vec<usize> = group.iter().map(|a| a.cause.effect).collect();
                if !members.contains(&cause.effect) {
                    members.push(cause.effect);
                }
                Self {
                    effect: context.catalogue[cause.effect].name().to_owned(),
                    members,
                    size: (&cause.projected * own).norm(),
                    false_alarm,
                }
            })
            .collect()
    }

    /// For each rival whether it would have been given this name, and no other beside it.
    pub fn given(&self, context: &Context<'_>, rivals: &Drawn) -> Vec<bool> {
        let leading = self.leading(context, rivals);
        (0..rivals.count)
            .into_par_iter()
            .map(|k| leading[k] && self.is_found(context, &rivals.readings.column(k).clone_owned()))
            .collect()
    }

    /// The rivals in which a gap is detected and one of the group is the most surprising effect, or may
    /// become it by refining. Families are scored only as long as one of the batch may still be such: the
    /// group first, then what the rivals were drawn from, which mostly leads.
    fn leading(&self, context: &Context<'_>, rivals: &Drawn) -> Vec<bool> {
        let (left, _) = context.space.forward(rivals.readings.clone());
        let mut scores = Scores::of(context, left);
        let members = self.members.iter().filter_map(|k| context.family_of(*k));
        let members: Vec<usize> = members.collect();
        let others = (0..context.catalogue.len()).filter_map(|k| context.family_of(k));
        let others = others.filter(|family| !members.contains(family));
        let mut others: Vec<usize> = others.collect();
        others.sort_by_key(|family| rivals.family != Some(*family));
        let mut own = [0.0f64; BATCH];
        for &family in &members {
            scores.add(family);
            for (own, row) in own.iter_mut().zip(&scores.rows) {
                *own = own.max(row[family]);
            }
        }
        let mut may: Vec<bool> = (0..rivals.count).map(|k| own[k] > 0.0).collect();
        for family in others {
            if !may.contains(&true) {
                return may;
            }
            scores.add(family);
            for k in 0..may.len() {
                may[k] &= own[k] >= (1.0 - UNSEARCHED) * scores.rows[k][family];
            }
        }
        // What has been scored may be enough to detect the gap: more of it makes none less probable.
        let is_detected = |scores: &Scores<'_>, k: usize| {
            context.null.detection(&scores.rows[k], scores.misfits[k]) <= self.false_alarm
        };
        if (0..may.len()).any(|k| may[k] && !is_detected(&scores, k)) {
            (0..context.dictionary.families.len()).for_each(|family| scores.add(family));
        }
        (0..may.len())
            .map(|k| may[k] && is_detected(&scores, k))
            .collect()
    }

    /// Whether refining leaves one of the group first, nothing stands out beside it, and no other effect passes in its
    /// place: all but what holds it and explains no more than chance. The others are searched only where one of the group passes.
    fn is_found(&self, context: &Context<'_>, readings: &DVector<f64>) -> bool {
        let first = context.remainder(readings, &[]);
        // What one leaves, and its unknowns, where it passes.
        let passed = |cause: &Cause| {
            let alone = std::slice::from_ref(cause);
            let left = context.judged_by(readings, alone, FEW_DRAWS);
            let passes = context.adequate(alone, &left);
            passes.then(|| (left.square, cause.unknowns()))
        };
        let refined = |effect: usize| refined(context, readings, &first, effect);
        let mut group: Vec<(usize, Cause, f64)> = self
            .members
            .iter()
            .filter(|effect| stands_out(context, &first, **effect))
            .filter_map(|&effect| refined(effect).map(|(cause, t)| (effect, cause, t)))
            .collect();
        group.sort_by(|a, b| b.2.total_cmp(&a.2));
        // Which effects are tried is known from all their scores, which need not be found where the only
        // one of the group does not pass.
        let is_tried = |effect: usize| ranked(context, &first).contains(&effect);
        let mut tried = group.iter();
        let best = tried.find(|(effect, ..)| group.len() == 1 || is_tried(*effect));
        let Some((effect, cause, most)) = best else {
            return false;
        };
        let Some(own) = passed(cause).filter(|_| is_tried(*effect)) else {
            return false;
        };
        let mut others = Vec::new();
        for effect in ranked(context, &first) {
            if self.members.contains(&effect) {
                continue;
            }
            if let Some((other, t)) = refined(effect) {
                let leads = t > *most;
                if leads && other.unknowns() <= cause.unknowns() {
                    return false;
                }
                others.push((other, leads));
            }
        }
        let stands = |(other, leads): &(Cause, bool)| {
            passed(other).map_or(*leads, |(left, unknowns)| {
                let alone = (std::slice::from_ref(other), unknowns, left);
                !holds(context, alone, (cause, own.0))
                    && (*leads || !outweighed(context, (left, unknowns), own))
            })
        };
        !others.iter().any(stands)
    }
}

/// Greatest scores of families in the rivals of a batch, found as they are asked for.
struct Scores<'a> {
    dictionary: &'a Dictionary,
    adjoint: Sums<f32, BATCH>,
    /// Squares of what the fit leaves.
    misfits: Vec<f64>,
    /// For each rival the surprise of each family, zero until it is found.
    rows: Vec<Vec<f64>>,
    known: Vec<bool>,
}

impl<'a> Scores<'a> {
    fn of(context: &'a Context<'_>, left: DMatrix<f64>) -> Self {
        let families = context.dictionary.families.len();
        Self {
            dictionary: &context.dictionary,
            misfits: left.column_iter().map(|c| c.norm_squared()).collect(),
            adjoint: seen(&context.dictionary, &context.space, left),
            rows: vec![vec![0.0; families]; BATCH],
            known: vec![false; families],
        }
    }

    fn add(&mut self, family: usize) {
        if !std::mem::replace(&mut self.known[family], true) {
            add_surprises(self.dictionary, family, &self.adjoint, &mut self.rows);
        }
    }
}

fn stands_out(context: &Context<'_>, first: &Remainder, effect: usize) -> bool {
    context.p_value(first, effect) < EARNED
}

/// The effects that stand out most.
fn ranked(context: &Context<'_>, first: &Remainder) -> Vec<usize> {
    let mut ranked: Vec<(f64, usize)> = (0..context.catalogue.len())
        .filter(|effect| stands_out(context, first, *effect))
        .filter_map(|effect| {
            let family = context.family_of(effect)?;
            Some((context.best(first, family).0, effect))
        })
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.truncate(REFINED);
    ranked.into_iter().map(|(_, effect)| effect).collect()
}

/// An effect refined, where its size is possible.
fn refined(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
    effect: usize,
) -> Option<(Cause, f64)> {
    let start = context.start(first, effect)?;
    let alone = context.beside(context.model, readings, &[]);
    let (cause, t) = alone.refine(effect, (start, Reach::WIDE));
    possible(context, readings, &[], &cause).then_some((cause, t))
}
