//! Which effect: a confidence set, not a winner.
//!
//! A cause is accepted when, refitted with everything else free, it leaves nothing that stands out
//! of the noise: no other effect, no place. All causes that pass are the confidence set (the
//! inversion of the test); significance alone names nothing. Of several each must earn its place.

use std::sync::Arc;

use nalgebra::DVector;

use crate::attribution::alternatives::{Alternative, alternatives, evidence, group_of};
use crate::attribution::context::{Cause, Context};
use crate::attribution::remainder::Remainder;
use crate::attribution::standing::stand_together;
use crate::levels::{BENT, EQUAL_EVIDENCE, FREELY, HOPELESS_PART, MOST_BENT};

/// Causes that together explain the gap, and those that do it as well.
pub(crate) struct Answer {
    /// The causes, by what each adds.
    pub causes: Vec<Cause>,
    /// For each cause the effects that these data cannot tell from it and itself, the cause first: it
    /// has the greatest evidence, unless those of greatest evidence do not pass together.
    pub groups: Vec<Vec<Alternative>>,
    /// What remains beside them.
    pub remainder: Arc<Remainder>,
    /// Whether the remainder is adequate.
    pub complete: bool,
}

/// All effects that could stand in place of each cause, the others kept.
pub(crate) fn confidence_set(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
) -> Answer {
    let best = context.relinearised(readings, causes, f64::INFINITY);
    let remainder = Arc::new(context.judged(readings, &best));
    let (mut best, mut remainder) = context.in_other_shapes(readings, best, remainder);
    let mut groups = Vec::new();
    // Of many that do not suffice each has been swapped for what explains more, and what is lacking is another.
    let tried = causes.len() <= FREELY || context.adequate(&best, &remainder);
    for k in 0..causes.len() {
        let mut members = if tried {
            alternatives(context, readings, (&best, &remainder), k, HOPELESS_PART)
        } else {
            Vec::new()
        };
        if members.is_empty() && causes.len() <= MOST_BENT {
            // What bends the state most is seen least at that state.
            let least = context.misfit(readings, &best);
            members = alternatives(context, readings, (&best, &remainder), k, BENT);
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

/// Brings the greatest evidence of each group to its front and makes it the cause, where these causes pass
/// together too; else the cause that was kept goes first.
fn led(context: &Context<'_>, readings: &DVector<f64>, mut answer: Answer) -> Answer {
    for group in &mut answer.groups {
        let rounded = |a: &Alternative| (a.evidence / EQUAL_EVIDENCE).round();
        group.sort_by(|a, b| rounded(b).total_cmp(&rounded(a)));
    }
    let leaders: Vec<Cause> = (answer.causes.iter().zip(&answer.groups))
        .map(|(kept, group)| match group.first() {
            Some(first) if first.cause.effect != kept.effect => first.cause.clone(),
            _ => kept.clone(),
        })
        .collect();
    let led = effects_of(&leaders);
    if led != effects_of(&answer.causes) && distinct(&led) {
        let trial = context.relinearised(readings, &leaders, f64::INFINITY);
        let left = Arc::new(context.judged(readings, &trial));
        if context.adequate(&trial, &left) && context.amplitudes(readings, &trial).is_some() {
            (answer.causes, answer.remainder) = (trial, left);
        }
    }
    for (group, cause) in answer.groups.iter_mut().zip(&answer.causes) {
        group.sort_by_key(|a| a.cause.effect != cause.effect);
    }
    answer.complete = context.adequate(&answer.causes, &answer.remainder)
        && stand_together(context, readings, &answer.causes);
    answer
}

fn effects_of(causes: &[Cause]) -> Vec<usize> {
    causes.iter().map(|c| c.effect).collect()
}

fn distinct(effects: &[usize]) -> bool {
    let mut earlier = effects.iter().enumerate();
    earlier.all(|(k, effect)| !effects[..k].contains(effect))
}
