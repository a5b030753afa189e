//! The grid of laws that closes in on where the probability lies.

use super::law::Law;
use super::likelihood::OfWhole;
use super::posterior::{NoiseValues, Possible};

/// Sides of the grid: the share of the correlated part, the logarithms of its length and of 1 + r of shift and drift.
const SIDES: usize = 4;
/// Points along each; those of shift and drift cost no further pass.
const COUNTS: [usize; SIDES] = [9, 9, 15, 11];
/// Rounds in which the grid closes in.
const MOST_ROUNDS: usize = 8;
/// The grid closes in on what has more than this share of the greatest probability.
pub(super) const NEGLIGIBLE: f64 = 1e-4;
/// The grid is fine enough when closing in would shorten none of its sides to less than this share.
const CLOSE: f64 = 0.7;
/// Greatest share of the correlated part: without any white noise the filter's weights would be infinite.
const MOST: f64 = 0.999;
/// Greatest shift, in the rest.
const MOST_SHIFT: f64 = 2000.0;
/// Greatest drift at the ends of the travel, in the rest.
const MOST_DRIFT: f64 = 700.0;

/// A side of the grid: from, to.
type Side = (f64, f64);

/// Goes over one kind of law; the logarithm of each point's probability, up to a constant, goes where
/// the probability belongs.
pub(super) fn explore(
    values: &impl NoiseValues,
    lengths: Option<Side>,
    (shift, drift): (bool, bool),
    reference: f64,
    possible: &mut Vec<Possible>,
) {
    let whole = |side: Option<Side>| side.unwrap_or((0.0, 0.0));
    let limits = [
        whole(lengths.map(|_| (0.0, MOST))),
        whole(lengths),
        whole(shift.then_some((0.0, MOST_SHIFT.ln_1p()))),
        whole(drift.then_some((0.0, MOST_DRIFT.ln_1p()))),
    ];
    let half_travel = values.reach().map_or(1.0, |(_, travel)| 0.5 * travel);
    let mut sides = limits;
    for round in 0..MOST_ROUNDS {
        let points = on_grid(values, lengths.is_some(), half_travel, &sides, reference);
        let next = closer(&points, &sides, &limits);
        let shortens = next
            .iter()
            .zip(&sides)
            .any(|(n, s)| s.1 > s.0 && n.1 - n.0 < CLOSE * (s.1 - s.0));
        if !shortens || round + 1 == MOST_ROUNDS {
            // The share that this grid has of the uniform probability beforehand.
            let share: f64 = sides
                .iter()
                .zip(&limits)
                .map(|(s, l)| {
                    if l.1 > l.0 {
                        (s.1 - s.0) / (l.1 - l.0)
                    } else {
                        1.0
                    }
                })
                .product();
            let log_cell = (share / points.len() as f64).ln();
            possible.extend(points.into_iter().map(|(_, mut p)| {
                p.probability += log_cell;
                p
            }));
            return;
        }
        sides = next;
    }
}

/// The middles of n equal parts of a side; the side itself where it is a point.
fn middles(side: Side, count: usize) -> Vec<f64> {
    if side.1 > side.0 {
        let width = (side.1 - side.0) / count as f64;
        (0..count)
            .map(|k| side.0 + (k as f64 + 0.5) * width)
            .collect()
    } else {
        vec![side.0]
    }
}

/// All points of a grid with their laws; the probability is its logarithm.
fn on_grid(
    values: &impl NoiseValues,
    correlated: bool,
    half_travel: f64,
    sides: &[Side; SIDES],
    reference: f64,
) -> Vec<([f64; SIDES], Possible)> {
    let beside = |log: f64| log.exp_m1().powi(2);
    let mut logs = Vec::new();
    for shift in middles(sides[2], COUNTS[2]) {
        logs.extend(
            middles(sides[3], COUNTS[3])
                .into_iter()
                .map(|drift| [shift, drift]),
        );
    }
    let whole: Vec<OfWhole> = logs
        .iter()
        .map(|[shift, drift]| OfWhole {
            shift: beside(*shift),
            drift: beside(*drift) / (half_travel * half_travel),
        })
        .collect();
    let mut points = Vec::new();
    for a in middles(sides[0], COUNTS[0]) {
        for b in middles(sides[1], COUNTS[1]) {
            let own = a * a;
            let length = if correlated { b.exp() } else { 1.0 };
            let found = values.likelihoods(1.0 - own, own, length, &whole);
            for ((likelihood, log), of) in found.into_iter().zip(&logs).zip(&whole) {
                let law = Law {
                    white: 1.0 - own,
                    correlated: own,
                    length,
                    shift: of.shift,
                    drift: of.drift,
                };
                let possible = Possible {
                    law,
                    probability: reference - likelihood.minus_log,
                    quadratic: likelihood.quadratic,
                };
                points.push(([a, b, log[0], log[1]], possible));
            }
        }
    }
    points
}

/// The box around what is not negligible, one step of the grid wider.
fn closer(
    points: &[([f64; SIDES], Possible)],
    sides: &[Side; SIDES],
    limits: &[Side; SIDES],
) -> [Side; SIDES] {
    let top = points
        .iter()
        .map(|(_, p)| p.probability)
        .fold(f64::NEG_INFINITY, f64::max);
    let mut next = [(f64::INFINITY, f64::NEG_INFINITY); SIDES];
    for (at, _) in points
        .iter()
        .filter(|(_, p)| p.probability > top + NEGLIGIBLE.ln())
    {
        for (side, v) in next.iter_mut().zip(at) {
            *side = (side.0.min(*v), side.1.max(*v));
        }
    }
    for (k, side) in next.iter_mut().enumerate() {
        let step = (sides[k].1 - sides[k].0) / COUNTS[k] as f64;
        *side = (
            (side.0 - step).max(limits[k].0),
            (side.1 + step).min(limits[k].1),
        );
    }
    next
}
