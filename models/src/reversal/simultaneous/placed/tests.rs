//! The rows of every effect against finite differences.

use std::sync::Arc;

use errsep_solvers::structured::Parameters;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Placed;
use crate::basis::bspline::CubicBSpline;
use crate::reversal::simultaneous::effects::{
    CATALOGUE, JoinedEffect, Kind, Setting, Unknown, times,
};
use crate::reversal::simultaneous::gauge::Axis;
use crate::reversal::simultaneous::joined::Joined;
use crate::reversal::simultaneous::problem::Reversal;
use crate::reversal::simultaneous::readings::ChannelReadings;
use crate::reversal::simultaneous::unknowns::Unknowns;
use crate::reversal::{Channel, Convention, Direction, Observations, Reading};

/// Two repeats in both directions at uneven positions, readings that climb by their tilts.
fn observations(random: &mut ChaCha8Rng) -> Observations {
    let mut readings = Vec::new();
    for repeat in [1, 2] {
        for direction in [Direction::Forward, Direction::Backward] {
            for (c, channel) in Channel::ALL.into_iter().enumerate() {
                for k in 0..23 {
                    let x = 9.0 * f64::from(k) + random.random_range(0.0..4.0);
                    let slope = [0.08, -0.1, 0.05, -0.12][c];
                    readings.push(Reading {
                        channel,
                        repeat,
                        direction,
                        time: Some(3.0 * readings.len() as f64),
                        x,
                        value: slope * x + random.random_range(-0.3..0.3),
                    });
                }
            }
        }
    }
    Observations { readings }
}

type Named = (&'static str, Arc<dyn JoinedEffect>);

fn unknowns_of(effects: &[Named]) -> Vec<Unknown> {
    effects.iter().flat_map(|(_, e)| e.unknowns()).collect()
}

/// A point of steep forms and tilts, with the effects at sizes and shapes well inside their ranges.
fn point(unknowns: &Unknowns, effects: &[Named], random: &mut ChaCha8Rng) -> Parameters {
    let mut at = Parameters::zeros(unknowns.band_count(), unknowns.border_count());
    for c in &mut at.band {
        *c = 300.0 * random.random_range(-1.0..1.0);
    }
    for y in &mut at.border {
        *y = 0.02 * random.random_range(-1.0..1.0);
    }
    if let Some(thickness) = unknowns.thickness_index() {
        at.border[thickness] = 40.0;
    }
    let started = effects.iter().flat_map(|(_, effect)| {
        let starts = effect.starts();
        starts[starts.len() / 2].clone()
    });
    for (k, (unknown, start)) in unknowns_of(effects).iter().zip(started).enumerate() {
        at.border[unknowns.effect(k)] = match (unknown.kind, unknown.unit) {
            // What an indicator adds must not turn its reading round where forms are this large.
            (Kind::Amplitude, "um") => 0.03 + 0.01 * k as f64,
            (Kind::Amplitude, "mm") => 0.7,
            (Kind::Amplitude, _) => 0.01,
            (Kind::Shape, _) => start + 0.1,
            (Kind::Searched, _) => start,
        };
    }
    at
}

/// Derivatives of all readings by the unknowns of band and border, out of the rows.
fn analytic(problem: &Reversal, at: &Parameters, count: usize) -> Vec<Vec<f64>> {
    let (n, q) = (
        problem.unknowns.band_count(),
        problem.unknowns.border_count(),
    );
    let starts = problem.row_starts();
    let mut columns = vec![vec![0.0; count]; n + q];
    problem
        .for_each_batch(at, |c, row, band, shares, batch| {
            for (l, unknown) in band.iter().enumerate() {
                if let Some(j) = unknown {
                    columns[*j][starts[c] + row] += batch.column(l)[0];
                }
            }
            for share in shares {
                let value = share.weight * batch.column(share.column as usize)[0];
                columns[n + share.unknown as usize][starts[c] + row] += value;
            }
        })
        .unwrap();
    columns
}

fn model(problem: &Reversal, at: &Parameters) -> Vec<f64> {
    let residuals = problem.residuals(at).unwrap();
    residuals.into_iter().flatten().map(|r| -r).collect()
}

#[test]
fn rows_are_those_of_finite_differences() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let observations = observations(&mut random);
    let times = times(&observations);
    let setting = Setting::of(&observations, &times, Convention::Seed, false);
    let mut compared = 0;
    for entry in CATALOGUE {
        for effect in (entry.variants)(&setting) {
            compared += compare(&observations, &times, &[(entry.name, effect)], &mut random);
        }
    }
    assert!(compared > 500, "{compared}");
}

/// An error of the scale stands behind a play, a drift and a gain, and its rows hold all of these.
#[test]
fn rows_of_a_whole_chain_are_those_of_finite_differences() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let observations = observations(&mut random);
    let times = times(&observations);
    let setting = Setting::of(&observations, &times, Convention::Seed, false);
    let of = |name: &str| {
        let entry = CATALOGUE.iter().find(|e| e.name == name).unwrap();
        (entry.name, (entry.variants)(&setting).remove(0))
    };
    let chain = [
        "cyclic-error",
        "hysteresis",
        "thermal-drift",
        "gain-mismatch",
    ]
    .map(of);
    compare(&observations, &times, &chain, &mut random);
}

/// Compares the derivatives by all unknowns of a fit with some effects, and returns how many they are.
fn compare(
    observations: &Observations,
    times: &[f64],
    effects: &[Named],
    random: &mut ChaCha8Rng,
) -> usize {
    let channels = ChannelReadings::sort(observations);
    let axis = Axis::of(&channels).unwrap();
    let basis = CubicBSpline::uniform(-5.0, 210.0, 5).unwrap();
    let joined = Joined::new(observations, times, effects);
    let unknowns = Unknowns::new(Channel::ALL.to_vec(), Convention::Seed, true, 8)
        .with_effects(joined.names());
    let at = point(&unknowns, effects, random);
    let bases = vec![basis; 3];
    let mut problem = Reversal::new(&channels, unknowns.clone(), bases, axis, 40.0, vec![1.0; 4])
        .joining(Some(&joined));
    if joined.plays() {
        let turning = Placed::turning(&problem, &joined, &at).unwrap();
        problem
            .joined
            .as_mut()
            .unwrap()
            .hold_turning(Some(Arc::new(turning)));
    }
    let columns = analytic(&problem, &at, observations.readings.len());
    let n = unknowns.band_count();
    let mut compared = 0;
    for (j, column) in columns.iter().enumerate() {
        if j >= n && problem.is_held(j - n) && unknowns.closure_index() != Some(j - n) {
            continue;
        }
        let moved = |step: f64| {
            let mut to = at.clone();
            let own = if j < n {
                &mut to.band[j]
            } else {
                &mut to.border[j - n]
            };
            *own += step;
            model(&problem, &to)
        };
        let norm = column.iter().map(|v| v * v).sum::<f64>().sqrt();
        let slope = |step: f64| -> Vec<f64> {
            let (up, down) = (moved(step), moved(-step));
            let pairs = up.iter().zip(&down);
            pairs.map(|(u, d)| (u - d) / (2.0 * step)).collect()
        };
        let of_effect = j.checked_sub(n + unknowns.effect(0));
        // About 10 nm in the readings; shapes change by their own measure.
        let mut step = 1e-2 / norm.max(1e-2);
        if of_effect.map(|k| unknowns_of(effects)[k].kind) == Some(Kind::Shape) {
            step = step.min(1e-3 * at.border[j - n].abs().max(0.1));
        }
        // Richardson's extrapolation.
        let (whole, half) = (slope(step), slope(0.5 * step));
        let pairs = whole.iter().zip(&half);
        let found: Vec<f64> = pairs.map(|(w, h)| (4.0 * h - w) / 3.0).collect();
        let error: f64 = found.iter().zip(column).map(|(f, c)| (f - c).powi(2)).sum();
        let name = if j < n {
            format!("c{j}")
        } else {
            unknowns.border_name(j - n)
        };
        let named: Vec<_> = effects
            .iter()
            .map(|(name, e)| (name, e.variant()))
            .collect();
        // Truncation: the fourth power of a step of a tenth of a period or width, rounding of mm.
        assert!(
            error.sqrt() < 2e-5 * norm.max(1e-2),
            "{named:?}: {name}, off by {:e} of {norm:e}",
            error.sqrt()
        );
        compared += 1;
    }
    compared
}
