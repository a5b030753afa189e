//! How a learnt effect fares on a campaign that it was not learnt from.

use errsep_models::model::{AnyModel, Effect, FittedModel, Shape};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

use crate::attribution::shrink::{GapMeter, HeldOut, Size, shrink};
use crate::catalogue::curve::{Along, Curve};
use crate::catalogue::tabulated::{Seen, Tabulated};
use crate::detection::calm::calmed;
use crate::detection::estimate::estimate;
use crate::detection::space::Space;
use crate::options::Options;

/// Curves that are drawn to say what chance explains.
const DRAWS: usize = 1000;
/// Cosines of a drawn curve.
const COSINES: usize = 24;
/// Points of a drawn curve in the place of a formula.
const POINTS: usize = 97;
/// Drawn curves that are projected at once.
const BATCH: usize = 100;

/// A learnt effect on other readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tested {
    /// The effect.
    pub effect: String,
    /// Where it was seen.
    pub seen: Seen,
    /// Its size here, one where it is as it was learnt.
    pub size: f64,
    /// Standard uncertainty of the size, that of the learnt curve included.
    pub size_std: f64,
    /// The gap without it.
    pub before: Size,
    /// The gap with it as it was learnt: nothing of it is fitted to these readings.
    pub after: Size,
    /// 1 − after / before.
    pub shrink: f64,
    /// On held-out repeats, its size fitted on the others.
    pub held_out: Option<HeldOut>,
    /// Part of the gap, squared, that it explains with its size fitted.
    pub explained: f64,
    /// The same of smooth curves drawn by chance, in the mean.
    pub by_chance: f64,
    /// Part of such curves that explain as much.
    pub p_value: f64,
    /// Part of the readings that lie outside the range in which it was seen.
    pub outside: f64,
}

/// `tested` of a model of any kind.
pub(crate) fn tested(model: &AnyModel, effect: &Tabulated, options: &Options) -> Option<Tested> {
    let seen = effect.seen.clone()?;
    let (calmed, _) = calmed(model);
    let model = calmed.as_ref().unwrap_or(model);
    let columns = effect.columns(model, &Shape::only());
    let change = columns.first()?.dense(model.places().len());
    let clean = model.refit(model.observed() - &change);
    let law = estimate(&clean, &clean.linearised());
    let space = Space::expecting(model, &law);
    let readings = model.linearised();
    let residual = space.forward_vector(&readings);
    let own = space.forward_vector(&change);
    let square = own.norm_squared();
    if !(square > 0.0) {
        return None;
    }
    let size = own.dot(&residual) / square;
    let open = effect.open(model, &Shape::only());
    let along = space.forward_columns(&open).0.tr_mul(&own) / square;
    let excess = residual.norm_squared() - space.degrees_of_freedom() as f64;
    let part = |explained: f64| {
        if excess > 0.0 {
            (explained / excess).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    let explained = part(size * size * square);
    let chance: Vec<f64> = by_chance(model, effect, &space, &residual, options.seed)
        .into_iter()
        .map(part)
        .collect();
    let count = chance.len().max(1) as f64;
    let as_much = chance.iter().filter(|c| **c >= explained).count() as f64;
    let meter = GapMeter::new(model, &law, options.seed);
    let (before, after) = (
        meter.size(&readings, 0),
        meter.size(&(&readings - &change), 0),
    );
    let signature = DMatrix::from_columns(std::slice::from_ref(&change));
    Some(Tested {
        effect: effect.name.clone(),
        seen,
        size,
        size_std: (1.0 / square + size * size * along.norm_squared()).sqrt(),
        before,
        after,
        shrink: shrink(before.rms, after.rms),
        held_out: meter.held_out(model, &readings, &signature),
        explained,
        by_chance: chance.iter().sum::<f64>() / count,
        p_value: (as_much + 1.0) / (count + 1.0),
        outside: effect.outside(model),
    })
}

/// What smooth curves explain of a residual, squared, each with its size fitted: bound to what the effect is
/// bound to, as many as it has, independent, of a length log-uniform between two spacings of the points and
/// the whole range.
fn by_chance(
    model: &AnyModel,
    effect: &Tabulated,
    space: &Space,
    residual: &DVector<f64>,
    seed: u64,
) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x6368_616e_6365);
    let mut explained = Vec::with_capacity(DRAWS);
    let effect = &curved(model, effect);
    while explained.len() < DRAWS {
        let columns: Vec<DVector<f64>> = (0..BATCH)
            .map(|_| {
                let other = drawn(effect, &mut random);
                let column = other.columns(model, &Shape::only());
                column.first().map_or_else(
                    || DVector::zeros(model.places().len()),
                    |c| c.dense(model.places().len()),
                )
            })
            .collect();
        let seen = space.forward(DMatrix::from_columns(&columns)).0;
        explained.extend(seen.column_iter().map(|column| {
            let square = column.norm_squared();
            if square > 0.0 {
                column.dot(residual).powi(2) / square
            } else {
                0.0
            }
        }));
    }
    explained
}

/// What is drawn in place of an effect: its curves, or of a formula one curve over what it is a function of.
fn curved(model: &AnyModel, effect: &Tabulated) -> Tabulated {
    let Some(formula) = &effect.formula else {
        return effect.clone();
    };
    let along = formula.along().unwrap_or(Along::Position);
    let values = along.values(model);
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let at = |k: usize| {
        [
            low + (high - low) * k as f64 / (POINTS - 1) as f64,
            0.0,
            0.0,
        ]
    };
    Tabulated {
        formula: None,
        along: Some(along),
        curve: vec![Curve {
            channel: None,
            direction: None,
            points: (0..POINTS).map(at).collect(),
            open: Vec::new(),
        }],
        ..effect.clone()
    }
}

/// The same effect with other curves.
fn drawn(effect: &Tabulated, random: &mut ChaCha8Rng) -> Tabulated {
    let mut other = effect.clone();
    let log_part: f64 = random.random();
    for curve in &mut other.curve {
        let (from, to) = match (curve.points.first(), curve.points.last()) {
            (Some(first), Some(last)) => (first[0], last[0]),
            _ => continue,
        };
        let range = to - from;
        let shortest = 2.0 * range / (curve.points.len().max(2) - 1) as f64;
        let length = shortest * (range / shortest).powf(log_part);
        let cosines: Vec<[f64; 2]> = (0..COSINES)
            .map(|_| {
                let frequency: f64 = StandardNormal.sample(random);
                [
                    frequency / length,
                    random.random::<f64>() * std::f64::consts::TAU,
                ]
            })
            .collect();
        let weight: f64 = StandardNormal.sample(random);
        for point in &mut curve.points {
            let at = point[0] - from;
            let sum: f64 = cosines
                .iter()
                .map(|[w, phase]| (w * at + phase).cos())
                .sum();
            point[1] = weight * sum;
        }
    }
    other
}
