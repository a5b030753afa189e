//! One pass over all rows: cost and triangle at a point.

use rayon::prelude::*;

use super::problem::{Parameters, StructuredProblem};
use super::sink::{LEAST_COST, Sink};
use crate::linear::bordered::{Bordered, BorderedCovariance, Group};
use crate::problem::NoValue;

/// Tasks factorised together before their triangles are folded; bounds the memory at any number of
/// knots.
const TASKS_AT_ONCE: usize = 1024;

/// Fewer tasks than this are not worth handing to another core.
const TASKS_A_CORE: usize = 8;

/// Cost and triangle of a problem at a point.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// ½ Σ r², or ½ Σ ρ(r²) under a robust loss.
    pub cost: f64,
    /// The factorised system.
    pub system: Bordered,
    /// Whether the cost says nothing: it is so small that residuals other than zero have vanished
    /// from it.
    pub(super) vanished: bool,
}

/// Factorises all rows at a point.
///
/// # Errors
/// [`NoValue`] where the model is not defined.
pub fn evaluate<P: StructuredProblem>(problem: &P, at: &Parameters) -> Result<Evaluation, NoValue> {
    let prepared = problem.prepare(at)?;
    let mut system = Bordered::new(
        problem.band_count(),
        problem.band_width(&prepared),
        problem.border_count(),
    );
    let mut cost = 0.0;
    let vanished = for_each_task(problem, &prepared, |groups| {
        for group in &groups {
            cost += group.cost;
            system.absorb(group, 1.0);
        }
    })?;
    system.finish();
    Ok(Evaluation {
        vanished: vanished && cost < LEAST_COST,
        cost,
        system,
    })
}

/// The trace of the hat matrix J cov Jᵀ, summed by part: how many unknowns the rows of each part
/// have used up. `covariance` is that of unit noise at the same point.
///
/// # Errors
/// [`NoValue`] where the model is not defined.
pub fn hat_traces<P: StructuredProblem>(
    problem: &P,
    at: &Parameters,
    covariance: &BorderedCovariance,
) -> Result<Vec<f64>, NoValue> {
    let prepared = problem.prepare(at)?;
    let mut traces = vec![0.0; problem.part_count()];
    for_each_task(problem, &prepared, |groups| {
        let shares: Vec<f64> = groups
            .par_iter()
            .map(|group| covariance.hat_trace(group, 1.0))
            .collect();
        for (group, share) in groups.iter().zip(shares) {
            traces[group.part] += share;
        }
    })?;
    Ok(traces)
}

/// Runs the tasks on all cores and hands over their groups in order, the next tasks being
/// worked on meanwhile. True where squares of residuals have vanished somewhere.
fn for_each_task<P: StructuredProblem>(
    problem: &P,
    prepared: &P::Prepared,
    mut take: impl FnMut(Vec<Group>) + Send,
) -> Result<bool, NoValue> {
    type Chunk = Result<Vec<(Vec<Group>, bool)>, NoValue>;
    let count = problem.task_count(prepared);
    let chunk = |from: usize| -> Chunk {
        (from..count.min(from + TASKS_AT_ONCE))
            .into_par_iter()
            .with_min_len(TASKS_A_CORE)
            .map_init(Sink::default, |sink, index| {
                problem.task(prepared, index, sink)?;
                Ok(sink.take())
            })
            .collect()
    };
    let mut ready = chunk(0)?;
    let mut next = TASKS_AT_ONCE;
    let mut vanished = false;
    loop {
        let mut hand_over = || {
            for (groups, some_vanished) in std::mem::take(&mut ready) {
                vanished |= some_vanished;
                take(groups);
            }
        };
        if next >= count {
            hand_over();
            return Ok(vanished);
        }
        let ((), following) = rayon::join(hand_over, || chunk(next));
        ready = following?;
        next += TASKS_AT_ONCE;
    }
}
