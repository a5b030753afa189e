//! What the score stage spares changes nothing: beside it stands the same judgement without any order or
//! early end.

use errsep_models::calibration_line::CalibrationLine;
use errsep_models::calibration_line::simulate::{CalibrationSimulation, Disturbance, simulate};
use errsep_models::model::{AnyModel, FittedModel};

use crate::attribution::context::{Cause, Context};
use crate::attribution::doubt::FEW_DRAWS;
use crate::attribution::examined::examined;
use crate::attribution::outweighed::{holds, outweighed};
use crate::attribution::standing::possible;
use crate::detection::estimate::estimate;
use crate::detection::null::rows_of;
use crate::levels::{EARNED, REFINED, UNSEARCHED};
use crate::search::Reach;
use crate::severity::grounds::Grounds;
use crate::severity::rivals::{Drawn, Family};
use crate::severity::stage::Name;

/// Four sets of twenty loads, noise of 1.
fn line(disturbance: Disturbance, seed: u64) -> CalibrationLine {
    let what = CalibrationSimulation {
        line: [0.5, 2.0],
        full_scale: 1000.0,
        loads: 20,
        sets: 4,
        both_directions: false,
        noise: 1.0,
        disturbances: vec![disturbance],
    };
    CalibrationLine::new(&simulate(&what, seed).unwrap(), None).unwrap()
}

/// For each rival whether it is named alike: all families scored, all effects that stand out refined.
fn given_plainly(context: &Context<'_>, name: &Name, rivals: &Drawn) -> Vec<bool> {
    let (left, _) = context.space.forward(rivals.readings.clone());
    let rows = rows_of(&context.dictionary, &context.space, left);
    let count = context.dictionary.families.len();
    let greatest = |row: &[f64], member: bool| {
        (0..context.catalogue.len())
            .filter(|k| name.members.contains(k) == member)
            .filter_map(|k| context.family_of(k))
            .map(|family| row[family])
            .fold(0.0, f64::max)
    };
    (0..rivals.count)
        .map(|k| {
            let row = &rows[k];
            let own = greatest(row, true);
            context.null.detection(&row[..count], row[count]) <= name.false_alarm
                && own > 0.0
                && own >= (1.0 - UNSEARCHED) * greatest(row, false)
                && is_first(context, name, rivals, k)
        })
        .collect()
}

fn is_first(context: &Context<'_>, name: &Name, rivals: &Drawn, rival: usize) -> bool {
    let readings = rivals.readings.column(rival).clone_owned();
    let first = context.remainder(&readings, &[]);
    let mut ranked: Vec<(f64, usize)> = (0..context.catalogue.len())
        .filter(|effect| context.p_value(&first, *effect) < EARNED)
        .filter_map(|effect| Some((context.best(&first, context.family_of(effect)?).0, effect)))
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.truncate(REFINED);
    let alone = context.beside(context.model, &readings, &[]);
    let refined: Vec<(Cause, f64)> = ranked
        .into_iter()
        .filter_map(|(_, effect)| {
            let start = context.start(&first, effect)?;
            let (cause, t) = alone.refine(effect, (start, Reach::WIDE));
            possible(context, &readings, &[], &cause).then_some((cause, t))
        })
        .collect();
    let passed = |cause: &Cause| {
        let alone = std::slice::from_ref(cause);
        let left = context.judged_by(&readings, alone, FEW_DRAWS);
        let passes = context.adequate(alone, &left);
        passes.then(|| (left.square, cause.unknowns()))
    };
    let (group, others): (Vec<_>, Vec<_>) = refined
        .iter()
        .partition(|(cause, _)| name.members.contains(&cause.effect));
    let best = group.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((cause, most, own)) =
        best.and_then(|(cause, most)| Some((cause, *most, passed(cause)?)))
    else {
        return false;
    };
    others.into_iter().all(|(other, t)| {
        let leads = *t > most;
        passed(other).map_or(!leads, |(left, unknowns)| {
            let alone = (std::slice::from_ref(other), unknowns, left);
            holds(context, alone, (cause, own.0))
                || (!leads && outweighed(context, (left, unknowns), own))
        })
    })
}

/// A drift near the limit of detection, of which smooth errors are often named alike, and a bend, of which
/// several effects are a group.
#[test]
fn nothing_is_lost_by_the_order_of_the_score_stage() {
    let (drift, quadratic) = (
        Disturbance::Drift {
            drift: 4.0,
            constant: 0.3,
        },
        Disturbance::Quadratic(6.0),
    );
    for (disturbance, seed) in [(drift, 2), (quadratic, 1)] {
        let model = AnyModel::new(&line(disturbance, seed));
        let catalogue = model.effects();
        let readings = model.linearised();
        let law = estimate(&model, &readings);
        let context = Context::new(&model, &catalogue, law, 200, 1);
        examined(&context, &readings, 0.01, |found| {
            let answer = found.found.expect("a gap this large is explained");
            let context = found.context;
            let mut alike = 0;
            let grounds = Grounds::of(context);
            for name in Name::all(context, found.readings, &answer, 0.01) {
                for family in Family::beside(context, &grounds, &name.members) {
                    let rivals = Drawn::of(context, &name, (family, &grounds), (1, 0), 64);
                    let given = name.given(context, &rivals);
                    // Exact limit: the same questions, asked in another order.
                    assert_eq!(
                        given,
                        given_plainly(context, &name, &rivals),
                        "{} by {}",
                        name.effect,
                        family.name(context, &grounds)
                    );
                    alike += given.iter().filter(|g| **g).count();
                }
            }
            assert!(
                alike >= 5,
                "{alike} named alike: there is little to compare"
            );
        });
    }
}
