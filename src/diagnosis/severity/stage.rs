//! The score stage: what the diagnosis would name in readings that hold a rival, by the signatures, the
//! null law and the levels of the diagnosis itself.
//!
//! All rivals of a batch are scored at once; only those in which the name stands first go on to be
//! refined and judged. State and noise stay those of the diagnosis, which makes both anew.

use errsep_models::model::FittedModel;
use nalgebra::DVector;
use rayon::prelude::*;

use crate::diagnosis::attribution::confidence::{Answer, possible};
use crate::diagnosis::attribution::context::{Cause, Context, Remainder};
use crate::diagnosis::detection::null::rows_of;
use crate::diagnosis::levels::{EARNED, REFINED, UNSEARCHED};
use crate::diagnosis::severity::rivals::Drawn;

/// A name that was given.
pub(in crate::diagnosis) struct Name {
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
    pub fn all<M: FittedModel>(
        context: &Context<'_, M>,
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
    pub fn given<M: FittedModel>(&self, context: &Context<'_, M>, rivals: &Drawn) -> Vec<bool> {
        let (left, _) = context.space.forward(rivals.readings.clone());
        let rows = rows_of(&context.dictionary, &context.space, left);
        let families = context.dictionary.families.len();
        (0..rivals.count)
            .into_par_iter()
            .map(|k| {
                let row = &rows[k];
                let alarmed =
                    context.null.detection(&row[..families], row[families]) <= self.false_alarm;
                alarmed && self.may_lead(context, row) && {
                    self.is_found(context, &rivals.readings.column(k).clone_owned())
                }
            })
            .collect()
    }

    /// Whether one of the group is the most surprising effect, or may become it by refining.
    fn may_lead<M: FittedModel>(&self, context: &Context<'_, M>, row: &[f64]) -> bool {
        let greatest = |member: bool| {
            (0..context.catalogue.len())
                .filter(|k| self.members.contains(k) == member)
                .filter_map(|k| context.family_of(k))
                .map(|family| row[family])
                .fold(0.0, f64::max)
        };
        let own = greatest(true);
        own > 0.0 && own >= (1.0 - UNSEARCHED) * greatest(false)
    }

    /// Whether refining leaves one of the group first, nothing stands out beside it, and no other
    /// effect passes in its place.
    fn is_found<M: FittedModel>(&self, context: &Context<'_, M>, readings: &DVector<f64>) -> bool {
        let first = context.remainder(readings, &[]);
        let refined = refined(context, readings, &first);
        let Some((best, _)) = refined.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
            return false;
        };
        let passes = |cause: &Cause| {
            let alone = std::slice::from_ref(cause);
            context.adequate(alone, &context.judged(readings, alone))
        };
        let others = refined
            .iter()
            .filter(|(cause, _)| !self.members.contains(&cause.effect));
        self.members.contains(&best.effect)
            && passes(best)
            && !others.into_iter().any(|(cause, _)| passes(cause))
    }
}

/// The effects that stand out, refined, as far as their sizes are possible.
fn refined<M: FittedModel>(
    context: &Context<'_, M>,
    readings: &DVector<f64>,
    first: &Remainder,
) -> Vec<(Cause, f64)> {
    let mut ranked: Vec<(f64, usize)> = (0..context.catalogue.len())
        .filter(|effect| context.p_value(first, *effect) < EARNED)
        .filter_map(|effect| {
            let family = context.family_of(effect)?;
            Some((context.best(first, family).0, effect))
        })
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.truncate(REFINED);
    ranked
        .into_iter()
        .filter_map(|(_, effect)| {
            let start = context.start(first, effect)?;
            let (cause, t) = context.refine(context.model, readings, effect, start, &[]);
            possible(context, readings, &[], &cause).then_some((cause, t))
        })
        .collect()
}
