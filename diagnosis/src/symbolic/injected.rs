//! How often a law of a gap's size would have been found: laws drawn from the grammar, put into the noise.

use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

use errsep_models::model::FittedModel;

use crate::symbolic::bench::Bench;
use crate::symbolic::function::Function;
use crate::symbolic::grammar::Term;

/// Tries for a law that the model does not absorb.
const TRIES: usize = 60;
/// Of two terms the smaller is at least this part of the greater.
const PART: f64 = 1.0 / 3.0;
/// Steps and bends are drawn from the middle of their range.
const INNER: f64 = 0.1;

/// How often a law of this size would have been found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Power {
    /// Laws put in.
    pub draws: usize,
    /// Laws told.
    pub found: usize,
    /// Part of them.
    pub probability: f64,
    /// Its 95 % interval (Clopper and Pearson).
    pub ci95: [f64; 2],
}

/// The power at a visible size, squared, in units of the noise.
pub(super) fn power(bench: &Bench<'_>, square: f64, draws: usize, seed: u64) -> Option<Power> {
    let one = |k: usize| {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0070_6f77);
        random.set_stream(k as u64 + 1);
        let change = drawn(bench, square, &mut random)?;
        let readings = change + bench.noise(k, &mut random);
        Some(bench.attempt(&readings).is_ok())
    };
    let told: Vec<bool> = (0..draws).into_par_iter().filter_map(one).collect();
    if told.is_empty() {
        return None;
    }
    let found = told.iter().filter(|t| **t).count();
    let (n, a) = (told.len() as f64, found as f64);
    let at = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(p.round(), |law| law.inverse_cdf(p));
    let low = if found == 0 {
        0.0
    } else {
        at(a, n - a + 1.0, 0.025)
    };
    let high = if found == told.len() {
        1.0
    } else {
        at(a + 1.0, n - a, 0.975)
    };
    Some(Power {
        draws: told.len(),
        found,
        probability: a / n,
        ci95: [low, high],
    })
}

/// The change of the readings by a law drawn from the grammar, one term or two, of a visible size.
fn drawn(bench: &Bench<'_>, square: f64, random: &mut ChaCha8Rng) -> Option<DVector<f64>> {
    let count = if random.random::<bool>() { 1 } else { 2 };
    let mut change = DVector::zeros(bench.model.places().len());
    let mut terms: Vec<Term> = Vec::new();
    for _ in 0..count {
        let size = PART.powf(random.random::<f64>());
        let joins = |t: Term| terms.iter().all(|known| bench.grammar.may_join(*known, t));
        let one = |_| term(bench, random).filter(|found| joins(found.0));
        let (own, column, seen) = (0..TRIES).find_map(one)?;
        terms.push(own);
        change += column * (size / seen);
    }
    let seen = bench.whole.residual(&change).norm();
    (seen > 0.0).then(|| change * (square.max(0.0).sqrt() / seen))
}

/// A term with amplitudes of chance, and how long it is seen.
fn term(bench: &Bench<'_>, random: &mut ChaCha8Rng) -> Option<(Term, DVector<f64>, f64)> {
    let grammar = &bench.grammar;
    let kind = random.random_range(0..grammar.kinds.len());
    let patterns = bench.patterns_of(kind);
    if patterns.is_empty() {
        return None;
    }
    let pattern = patterns[random.random_range(0..patterns.len())];
    let (function, c) = (
        grammar.kinds[kind].function,
        &grammar.coordinates[grammar.kinds[kind].coordinate],
    );
    let [low, high] = function.bounds(c);
    let inner = matches!(function, Function::Step | Function::Corner);
    let inner = if inner { INNER } else { 0.0 };
    let part = inner + (1.0 - 2.0 * inner) * random.random::<f64>();
    let term = Term {
        kind,
        pattern,
        shape: low + part * (high - low),
    };
    let turn = std::f64::consts::TAU * random.random::<f64>();
    let amplitudes = match function.order() {
        2 => vec![turn.cos(), turn.sin()],
        _ => vec![if turn.cos() < 0.0 { -1.0 } else { 1.0 }],
    };
    bench.whole.seen(grammar, &[term])?;
    let column = bench.change(&[term], &DVector::from_vec(amplitudes));
    let seen = bench.whole.residual(&column).norm();
    (seen > 0.0).then_some((term, column, seen))
}
