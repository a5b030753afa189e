//! Minimisation with effects: shapes stay within their bounds, steps are searched, and the turning points of
//! a play are held within each descent.

use std::sync::Arc;

use errsep_solvers::options::Options;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredFit, fit_structured};

use super::effects::{Kind, Left, Unknown};
use super::error::ReversalError;
use super::placed::Placed;
use super::problem::Reversal;

/// Most descents one after the other.
const MOST_DESCENTS: usize = 20;

/// New turning points no longer matter where they move the cost by less than this share of it: single
/// readings that lie at a turn.
const SAME_COST: f64 = 1e-6;

/// Minimises; without effects in one descent.
///
/// # Errors
/// [`ReversalError`] where the model is not defined at the start.
pub fn minimise(
    problem: &mut Reversal,
    start: Parameters,
    options: &Options,
) -> Result<StructuredFit, ReversalError> {
    if problem.joined.is_none() {
        return Ok(fit_structured(problem, start, options)?);
    }
    let (mut at, mut history) = (start, Vec::new());
    let (mut before, mut descents) = (f64::INFINITY, 0);
    loop {
        hold_turning(problem, &at)?;
        let mut fit = fit_structured(problem, at, options)?;
        descents += 1;
        history.append(&mut fit.history);
        fit.history.clone_from(&history);
        let mut next = fit.parameters.clone();
        let moved = keep_within(problem, &mut next);
        if descents >= MOST_DESCENTS || !(moved || fit.converged()) {
            return Ok(fit);
        }
        let stepped = fit.converged() && search_steps(problem, &mut next)?;
        let same = (before - fit.cost).abs() <= SAME_COST * fit.cost;
        if !moved && !stepped && (same || !would_turn(problem, &next)?) {
            return Ok(fit);
        }
        before = fit.cost;
        at = next;
    }
}

/// The minimum with the effects held where they begin: what they change hangs on forms and tilts, which a
/// start has not yet.
///
/// # Errors
/// [`ReversalError`] where the model is not defined at the start.
pub fn approach(
    problem: &Reversal,
    start: Parameters,
    options: &Options,
) -> Result<Parameters, ReversalError> {
    if problem.joined.is_none() {
        return Ok(start);
    }
    let mut held = problem.clone();
    for k in 0..problem.unknowns.effects.len() {
        held.hold(problem.unknowns.effect(k), true);
    }
    hold_turning(&mut held, &start)?;
    Ok(fit_structured(&held, start, options)?.parameters)
}

/// Holds the turning points of a play where they are at this point.
fn hold_turning(problem: &mut Reversal, at: &Parameters) -> Result<(), NoValue> {
    let Some(joined) = problem.joined.as_ref().filter(|j| j.plays()) else {
        return Ok(());
    };
    let turning = Arc::new(Placed::turning(problem, joined, at)?);
    if let Some(joined) = &mut problem.joined {
        joined.hold_turning(Some(turning));
    }
    Ok(())
}

/// Whether the turning points of a play are others than those held.
fn would_turn(problem: &Reversal, at: &Parameters) -> Result<bool, NoValue> {
    match &problem.joined {
        Some(joined) if joined.plays() => {
            let turning = Placed::turning(problem, joined, at)?;
            Ok(joined.turning().is_none_or(|held| **held != turning))
        }
        _ => Ok(false),
    }
}

/// The bound that an unknown has gone beyond: of shapes, and of sizes that cannot be negative.
fn bound(unknown: &Unknown, value: f64) -> Option<f64> {
    match unknown.kind {
        Kind::Shape if value < unknown.low => Some(unknown.low),
        Kind::Shape if value > unknown.high => Some(unknown.high),
        Kind::Amplitude if unknown.low == 0.0 && value < 0.0 => Some(0.0),
        _ => None,
    }
}

/// Puts what has left its bounds on them and holds it there from now on.
fn keep_within(problem: &mut Reversal, at: &mut Parameters) -> bool {
    let unknowns: Vec<Unknown> = match &problem.joined {
        Some(joined) => joined.unknowns().cloned().collect(),
        None => Vec::new(),
    };
    let mut moved = false;
    for (k, unknown) in unknowns.iter().enumerate() {
        let j = problem.unknowns.effect(k);
        if let Some(bound) = bound(unknown, at.border[j]) {
            at.border[j] = bound;
            problem.hold(j, true);
            moved = true;
        }
    }
    moved
}

/// Moves what is searched over to its best, everything else held: whether anything moved.
fn search_steps(problem: &Reversal, at: &mut Parameters) -> Result<bool, NoValue> {
    let mut moved = false;
    for (k, value, _) in steps(problem, at)? {
        let own = &mut at.border[problem.unknowns.effect(k)];
        moved |= *own != value;
        *own = value;
    }
    Ok(moved)
}

/// What is searched over at its best, everything else held: place among the effects' unknowns, value and
/// standard uncertainty by the spacing of the readings.
///
/// # Errors
/// [`NoValue`] where the model is not defined.
pub fn steps(problem: &Reversal, at: &Parameters) -> Result<Vec<(usize, f64, f64)>, NoValue> {
    let Some(joined) = &problem.joined else {
        return Ok(Vec::new());
    };
    if !joined.are_searched().contains(&true) {
        return Ok(Vec::new());
    }
    let residuals = problem.residuals(at)?;
    let mut left = Vec::new();
    for ((channel, own), weight) in problem
        .channels
        .iter()
        .zip(&residuals)
        .zip(&problem.weights)
    {
        left.extend(channel.source.iter().zip(own).map(|(i, residual)| Left {
            at: joined.circumstances(*i),
            residual: *residual,
            weight: *weight,
        }));
    }
    Ok(joined.searched(&left, problem.unknowns.effect_values(&at.border)))
}
