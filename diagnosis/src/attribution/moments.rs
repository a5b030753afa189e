//! How well the moment is known at which a cause begins that lasts.
//!
//! Its signature steps from one reading to the next, so that it has no derivative by the moment. Every interval
//! between two readings is as probable as it is long, times the likelihood of the readings with the cause beginning
//! there, exp(T/2) with T the statistic of the cause beside the others (a flat law before the readings; Hinkley,
//! Inference about the change-point in a sequence of random variables (1970)). About the moment that is named the
//! intervals leave the mean square Σ w ((m − named)² + d²/12), with w their probabilities, m their middles and d
//! their lengths; their sizes likewise scatter about the one that is named.

use nalgebra::{DMatrix, DVector};

use crate::attribution::context::{Cause, Context};
use crate::attribution::refine::Seen;
use crate::detection::dictionary::inverse;

/// How far below the best a statistic may lie for its moment to count: its likelihood is e⁻⁵ of the best one's at least.
/// Moments of less are as many as there are readings, and chance alone would let them count by their distance.
const AS_WELL: f64 = 10.0;

/// Moments in a row that do not count, after which no further ones are tried: the statistic falls unevenly.
const PAST: usize = 16;

/// What the readings leave open of a cause's moment.
pub(super) struct Moment {
    /// The moment: where the signature is the same from one reading to the next, the middle between them.
    pub value: f64,
    /// Its standard uncertainty.
    pub std: f64,
    /// What moments that fit nearly as well add to the covariance of the amplitudes.
    pub added: DMatrix<f64>,
}

/// One interval between two readings.
struct Interval {
    length: f64,
    middle: f64,
    statistic: f64,
    amplitudes: DVector<f64>,
}

impl Moment {
    /// The moment of one of several causes; nothing where it has none. `within` is the standard uncertainty where the
    /// signature changes within the interval too, as of readings that are means of several: the interval counts as
    /// well, as the one mean that says where in it the moment is may be taken for a wrong reading.
    pub fn of(
        context: &Context<'_>,
        readings: &DVector<f64>,
        (causes, which): (&[Cause], usize),
        within: Option<f64>,
    ) -> Option<Self> {
        let cause = &causes[which];
        let named = *cause.shape.values.first()?;
        let moments = context.catalogue[cause.effect].moments(context.model, &cause.shape);
        let own = moments.partition_point(|m| *m <= named).checked_sub(1)?;
        let mut others = causes.to_vec();
        others.remove(which);
        let beside = context.beside(context.model, readings, &others);
        let seen = beside.seen(cause.effect);
        let bounds: Vec<&[f64]> = moments.windows(2).collect();
        let mut here = interval(&seen, cause, bounds.get(own)?, named)?;
        let named = if within.is_some() {
            named
        } else {
            middle(bounds[own])
        };
        here.middle = named;
        let sizes = here.amplitudes.clone();
        let all = beside_best(&seen, cause, &bounds, (own, here));
        let best = all
            .iter()
            .map(|i| i.statistic)
            .fold(f64::NEG_INFINITY, f64::max);
        let weight = |i: &Interval| i.length * (0.5 * (i.statistic - best)).exp();
        let whole: f64 = all.iter().map(weight).sum();
        let mut square = within.map_or(0.0, |std| std * std);
        let mut added = DMatrix::zeros(sizes.len(), sizes.len());
        for interval in &all {
            let part = weight(interval) / whole;
            let away = interval.middle - named;
            square += part * (away * away + interval.length * interval.length / 12.0);
            let moved = &interval.amplitudes - &sizes;
            added.ger(part, &moved, &moved, 1.0);
        }
        Some(Self {
            value: named,
            std: square.sqrt(),
            added,
        })
    }
}

/// The intervals that fit nearly as well as the best, sought from the one that is named both ways.
fn beside_best(
    seen: &Seen<'_>,
    cause: &Cause,
    bounds: &[&[f64]],
    (own, here): (usize, Interval),
) -> Vec<Interval> {
    let mut best = here.statistic;
    let mut all = vec![here];
    let later: Vec<usize> = (own + 1..bounds.len()).collect();
    let sooner: Vec<usize> = (0..own).rev().collect();
    for way in [later, sooner] {
        let mut past = 0;
        for k in way {
            let Some(next) = interval(seen, cause, bounds[k], middle(bounds[k])) else {
                break;
            };
            best = best.max(next.statistic);
            past = if next.statistic < best - AS_WELL {
                past + 1
            } else {
                0
            };
            all.push(next);
            if past == PAST {
                break;
            }
        }
    }
    all.retain(|interval| interval.statistic >= best - AS_WELL);
    all
}

fn middle(bounds: &[f64]) -> f64 {
    0.5 * (bounds[0] + bounds[1])
}

/// An interval with the cause beginning at a moment in it; nothing where it may not.
fn interval(seen: &Seen<'_>, cause: &Cause, bounds: &[f64], moment: f64) -> Option<Interval> {
    let mut shape = cause.shape.clone();
    shape.values[0] = moment;
    if !seen.effect.allowed(seen.state, &shape) {
        return None;
    }
    let (statistic, gram, score) = seen.value(&shape);
    Some(Interval {
        length: bounds[1] - bounds[0],
        middle: moment,
        statistic,
        amplitudes: inverse(&gram) * score,
    })
}
