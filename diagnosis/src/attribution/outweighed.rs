//! Which of the effects that pass in a cause's place stay in its group.

use std::sync::Arc;

use crate::attribution::context::{Cause, Context, span};
use crate::attribution::remainder::Remainder;
use crate::levels::{HELD, ODDS, OUTDONE, chi_squared_quantile};

/// One way to explain the gap: causes with one of them varied.
pub(crate) struct Member {
    pub causes: Vec<Cause>,
    pub misfit: f64,
    pub evidence: f64,
    pub left: Arc<Remainder>,
    /// Size as a part of what is physically plausible.
    pub size: f64,
}

/// Drops what stands by its freedom alone, what holds another, and what is outweighed.
pub(crate) fn drop_outweighed(context: &Context<'_>, members: &mut Vec<Member>, k: usize) {
    drop_outdone(context, members, k);
    drop_holders(context, members, k);
    drop_unlikely(context, members, k);
}

/// Drops what stands in the place of the member of greatest evidence by its freedom alone: what a search of
/// relatives has freed beyond the dictionary must pay for it, and so must unknowns by which it explains no
/// more than chance.
fn drop_outdone(context: &Context<'_>, members: &mut Vec<Member>, k: usize) {
    let known = |m: &Member| (m.evidence, m.causes[k].unknowns(), m.misfit);
    let leader = members.iter().map(known);
    let Some((most, fewest, misfit)) = leader.max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return;
    };
    members.retain(|m| {
        let more = m.causes[k].unknowns().saturating_sub(fewest);
        if more == 0 || m.evidence > most - OUTDONE {
            return true;
        }
        let order = context
            .family_of(m.causes[k].effect)
            .map(|f| context.order_of(f));
        let freed = order.is_some_and(|order| m.causes[k].columns.len() > order);
        let earned = misfit - m.misfit > chi_squared_quantile(0.99, more);
        earned && !freed
    });
}

/// Drops what holds the signature of the member of greatest evidence among others of its own that explain no
/// more than chance: it is that member, and something that is not seen.
fn drop_holders(context: &Context<'_>, members: &mut Vec<Member>, k: usize) {
    let Some(most) =
        (0..members.len()).max_by(|a, b| members[*a].evidence.total_cmp(&members[*b].evidence))
    else {
        return;
    };
    let leader = &members[most];
    let cause = leader.causes[k].clone();
    let left = leader.misfit;
    members.retain(|m| {
        let other = (&m.causes[..], m.causes[k].unknowns(), m.misfit);
        !holds(context, other, (&cause, left))
    });
}

/// Whether causes, with the unknowns of the one that varies and what they leave, hold the signature of another cause among
/// others of their own that explain no more than chance.
pub(crate) fn holds(
    context: &Context<'_>,
    (causes, unknowns, left): (&[Cause], usize, f64),
    (own, left_by_own): (&Cause, f64),
) -> bool {
    let more = unknowns.saturating_sub(own.unknowns());
    if more == 0 || left_by_own - left > chi_squared_quantile(0.99, more) {
        return false;
    }
    let basis = span(causes, context.space.readings());
    let beside = &own.projected - &basis * basis.tr_mul(&own.projected);
    beside.norm_squared() <= HELD * own.projected.norm_squared()
}

/// Drops what is outweighed by the member of greatest evidence.
fn drop_unlikely(context: &Context<'_>, members: &mut Vec<Member>, k: usize) {
    let known = |m: &Member| (m.evidence, m.causes[k].unknowns(), m.misfit);
    let leader = members.iter().map(known);
    let Some((_, unknowns, misfit)) = leader.max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return;
    };
    members.retain(|m| {
        let own = (m.misfit, m.causes[k].unknowns());
        !outweighed(context, own, (misfit, unknowns))
    });
}

/// Whether of two explanations, each by what it leaves and its unknowns, the first is outweighed by the
/// second: the odds are those of their likelihoods, in which further unknowns of the second count against
/// it (Schwarz's approximation), those of the first not.
pub(crate) fn outweighed(context: &Context<'_>, first: (f64, usize), second: (f64, usize)) -> bool {
    let further = second.1.saturating_sub(first.1) as f64;
    let log_readings = (context.space.readings() as f64).ln();
    first.0 - second.0 - further * log_readings > 2.0 * ODDS.ln()
}
