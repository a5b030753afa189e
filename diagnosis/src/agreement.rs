//! How often the score stage and a whole diagnosis say the same of a rival.

use errsep_models::model::{AnyModel, FittedModel};
use rayon::prelude::*;

use crate::attribution::context::Context;
use crate::attribution::examined::examined;
use crate::detection::calm::calmed;
use crate::detection::estimate::estimate;
use crate::detection::fitted::without_misfit;
use crate::diagnose::diagnose_with;
use crate::options::Options;
use crate::severity::grounds::Grounds;
use crate::severity::rivals::{Drawn, Family};
use crate::severity::stage::Name;

/// Rivals of one family that were named by the score stage and by whole diagnoses.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Agreement {
    /// The family, as the rivals of a verdict are named.
    pub family: String,
    /// Rivals.
    pub cases: usize,
    /// Given the name by the score stage.
    pub scored: usize,
    /// Given the name by a whole diagnosis.
    pub whole: usize,
    /// Given it by both.
    pub both: usize,
}

/// `agreement` of a model of any kind.
pub(super) fn agreement(model: &AnyModel, options: &Options, each: usize) -> Vec<Agreement> {
    let is_known = |name: &str| !options.without.iter().any(|out| out == name);
    let mut catalogue = model.effects();
    catalogue.retain(|effect| is_known(effect.name()));
    let (calmed, calm) = calmed(model);
    let model = calmed.as_ref().unwrap_or(model);
    let readings = model.linearised();
    let law = estimate(model, &readings).with_tails(calm.tails);
    let context = Context::new(model, &catalogue, law, options.draws, options.seed);
    examined(&context, &readings, options.false_alarm, |found| {
        let Some(answer) = found.found.filter(|answer| answer.complete) else {
            return Vec::new();
        };
        let names = Name::all(found.context, found.readings, &answer, options.false_alarm);
        let grounds = Grounds::of(found.context);
        let mut rows = Vec::new();
        for name in &names {
            for family in Family::beside(found.context, &grounds, &name.members) {
                rows.push(compared(
                    found.context,
                    name,
                    (family, &grounds),
                    options,
                    each,
                ));
            }
        }
        rows
    })
}

fn compared(
    context: &Context<'_>,
    name: &Name,
    (family, grounds): (Family, &Grounds),
    options: &Options,
    each: usize,
) -> Agreement {
    let rivals = Drawn::of(context, name, (family, grounds), (options.seed, 0), each);
    let scored = name.given(context, &rivals);
    let base = without_misfit(context.model);
    let whole: Vec<bool> = (0..rivals.count)
        .into_par_iter()
        .map(|k| {
            let made = context.model.refit(&base + rivals.readings.column(k));
            let own = Options {
                severity: 0,
                ..options.clone()
            };
            let verdict = diagnose_with(&made, made.effects(), &own).verdict;
            let causes = verdict.causes();
            let of_group = |said: &&str| {
                let mut own = name.members.iter();
                own.any(|k| context.catalogue[*k].name() == *said)
            };
            causes.len() == 1 && causes.iter().flatten().all(of_group)
        })
        .collect();
    let count = |kept: &dyn Fn(usize) -> bool| (0..rivals.count).filter(|k| kept(*k)).count();
    Agreement {
        family: family.name(context, grounds),
        cases: rivals.count,
        scored: count(&|k| scored[k]),
        whole: count(&|k| whole[k]),
        both: count(&|k| scored[k] && whole[k]),
    }
}
