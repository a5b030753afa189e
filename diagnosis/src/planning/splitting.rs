//! Which further measurement would tell the members of a group apart.
//!
//! With c the whitened, projected change by the effect named first, in the readings there are and
//! in further ones, and Q the span of another member and of the other causes in both, the two lie
//! |(1 − Q)c| standard deviations apart. The first measurement on the model's list that takes them
//! far enough apart is named; if none does, the one that takes them farthest.

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};

use crate::attribution::alternatives::Alternative;
use crate::attribution::confidence::Answer;
use crate::attribution::context::{Cause, Context};
use crate::detection::basis::orthonormal;
use crate::detection::space::Space;
use crate::levels::{TELL, normal_quantile};

/// A further measurement for a group.
pub(crate) struct Split {
    /// What to do, in words.
    pub measurement: String,
    /// Standard deviations between the effect named first and the member nearest to it, now.
    pub now: f64,
    /// The same with the further measurement.
    pub then: f64,
}

impl Split {
    /// Whether it suffices.
    pub fn suffices(&self) -> bool {
        self.then > (2.0 * normal_quantile(TELL))
    }
}

/// For each cause of an answer that stands for a group, the measurement that splits it,
/// where the model knows of any.
pub(crate) fn splits(
    context: &Context<'_>,
    readings: &DVector<f64>,
    answer: &Answer,
) -> Vec<Option<Split>> {
    let groups = answer.groups.iter().enumerate();
    let mut groups = groups.filter(|(_, group)| group.len() > 1).peekable();
    if groups.peek().is_none() {
        return Vec::new();
    }
    let further: Vec<(String, AnyModel, Space)> = context
        .model
        .further()
        .into_iter()
        .map(|(name, model)| {
            let space = Space::expecting(&model, &context.law);
            (name, model, space)
        })
        .collect();
    groups
        .map(|(k, group)| split(context, readings, &answer.causes, k, group, &further))
        .collect()
}

fn split(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    k: usize,
    group: &[Alternative],
    further: &[(String, AnyModel, Space)],
) -> Option<Split> {
    let (amplitudes, _) = context.amplitudes(readings, causes)?;
    let from: usize = causes[..k].iter().map(|c| c.columns.len()).sum();
    let own = amplitudes.rows(from, causes[k].columns.len()).clone_owned();
    let mut others = causes.to_vec();
    let named = others.remove(k);
    let rivals: Vec<&Cause> = group
        .iter()
        .map(|alternative| &alternative.cause)
        .filter(|rival| rival.effect != named.effect)
        .collect();
    let apart = |extra: Option<&(String, AnyModel, Space)>| -> Option<f64> {
        let signatures = |cause: &Cause| {
            let here = cause.projected.clone();
            extra.map_or(here.clone(), |(_, model, space)| {
                let effect = &context.catalogue[cause.effect];
                let unit = vec![1.0; cause.columns.len()];
                let (shape, grown) = effect.carried(context.model, model, &cause.shape, &unit);
                let mut there = space.forward_columns(&effect.columns(model, &shape)).0;
                for (mut column, grown) in there.column_iter_mut().zip(grown) {
                    column *= grown;
                }
                below(&here, &there)
            })
        };
        let change = signatures(&named) * &own;
        rivals
            .iter()
            .map(|rival| {
                let all: Vec<DVector<f64>> = std::iter::once(*rival)
                    .chain(&others)
                    .flat_map(|c| {
                        let columns = signatures(c);
                        let own: Vec<_> = columns.column_iter().map(|c| c.clone_owned()).collect();
                        own
                    })
                    .collect();
                let all = DMatrix::from_columns(&all);
                let sizes: Vec<f64> = all.column_iter().map(|c| c.norm()).collect();
                let basis = orthonormal(&all, &sizes);
                (&change - &basis * basis.tr_mul(&change)).norm()
            })
            .min_by(f64::total_cmp)
    };
    let now = apart(None)?;
    let mut best: Option<Split> = None;
    for extra in further {
        let then = apart(Some(extra))?;
        let found = Split {
            measurement: extra.0.clone(),
            now,
            then,
        };
        if found.suffices() {
            return Some(found);
        }
        if best.as_ref().is_none_or(|b| b.then < then) {
            best = Some(found);
        }
    }
    best
}

fn below(upper: &DMatrix<f64>, lower: &DMatrix<f64>) -> DMatrix<f64> {
    let mut both = DMatrix::zeros(upper.nrows() + lower.nrows(), upper.ncols());
    both.rows_mut(0, upper.nrows()).copy_from(upper);
    both.rows_mut(upper.nrows(), lower.nrows()).copy_from(lower);
    both
}
