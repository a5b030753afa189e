//! Every effect of the catalogue against the readings.

use errsep_models::model::{Estimate, FittedModel, Shape};
use nalgebra::{DMatrix, DVector};

use super::attribute::Answer;
use super::bench::{Bench, Cause, Remainder};
use super::dictionary::statistic;
use super::verdict::Candidate;

/// Parameters of a cause beside others: amplitudes and shape with their joint covariance.
fn parameters<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    causes: &[Cause],
    which: usize,
) -> Vec<Estimate> {
    let Some((amplitudes, _)) = bench.amplitudes(readings, causes) else {
        return Vec::new();
    };
    let mut columns: Vec<DVector<f64>> = Vec::new();
    let mut own = (0, 0);
    let mut at = 0;
    for (k, cause) in causes.iter().enumerate() {
        let count = cause.projected.ncols();
        let used = amplitudes.rows(at, count).clone_owned();
        if k == which {
            own = (columns.len(), at);
        }
        columns.extend(cause.projected.column_iter().map(|c| c.clone_owned()));
        for (j, step) in cause.shape.steps.iter().enumerate() {
            if *step == 0.0 {
                continue;
            }
            let moved = |sign: f64| {
                let mut shape: Shape = cause.shape.clone();
                shape.values[j] += sign * 0.1 * step;
                bench.cause(bench.model, cause.effect, shape).projected * &used
            };
            let slope = (moved(1.0) - moved(-1.0)) / (0.2 * step);
            if slope.norm() > 0.0 {
                columns.push(slope);
            }
        }
        at += count;
    }
    let count = causes[which].projected.ncols();
    let stacked = DMatrix::from_columns(&columns);
    let gram = stacked.tr_mul(&stacked);
    let covariance = gram
        .clone()
        .cholesky()
        .map(|c| c.inverse())
        .or_else(|| gram.pseudo_inverse(1e-12).ok());
    let size = count + causes[which].shape.values.len();
    let covariance = covariance.map_or_else(
        || DMatrix::from_element(size, size, f64::NAN),
        |all| {
            DMatrix::from_fn(size, size, |i, j| {
                all.get((own.0 + i, own.0 + j)).map_or(f64::NAN, |v| *v)
            })
        },
    );
    let (effect, shape) = (&bench.catalogue[causes[which].effect], &causes[which].shape);
    let mut estimates = effect.estimates(
        shape,
        &amplitudes.as_slice()[own.1..own.1 + count],
        &covariance,
    );
    // Shape parameters follow the amplitudes. A step between two readings has no derivative.
    for (estimate, own) in estimates
        .iter_mut()
        .skip(count)
        .zip(effect.resolution(bench.model, shape))
    {
        estimate.std = if estimate.std.is_nan() {
            own
        } else {
            estimate.std.hypot(own)
        };
    }
    estimates
}

/// What each effect explains, by that.
pub(super) fn candidates<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    first: &Remainder,
    excess: f64,
    found: Option<&Answer>,
    causes: &[Cause],
) -> Vec<Candidate> {
    let readings_count = bench.space.readings() as f64;
    let mut list: Vec<(f64, Candidate)> = Vec::new();
    for (effect, description) in bench.catalogue.iter().enumerate() {
        let Some(family) = bench.family_of(effect) else {
            continue;
        };
        let about = description.about();
        let named = causes.iter().position(|c| c.effect == effect);
        let (cause, beside, which) = match named {
            Some(which) => (Some(causes[which].clone()), causes.to_vec(), which),
            None => {
                let start = bench.start(first, effect).cloned();
                let cause = start.map(|shape| bench.cause(bench.model, effect, shape));
                (cause.clone(), cause.into_iter().collect(), 0)
            }
        };
        let (t, unknowns) = cause.as_ref().map_or((0.0, 0), |c| {
            let gram = c.projected.tr_mul(&c.projected);
            let score = c.projected.tr_mul(&first.residual);
            let unknowns = c.projected.ncols() + c.shape.free();
            (statistic(&gram, &score, false), unknowns)
        });
        let in_set =
            found.is_some_and(|a| a.complete && a.groups.iter().any(|g| g.contains(&effect)));
        list.push((
            t,
            Candidate {
                effect: description.name().to_owned(),
                explained: ((t - unknowns as f64) / excess).clamp(0.0, 1.0),
                p_value: bench.p_value(first, effect),
                evidence: 0.5 * (t - unknowns as f64 * readings_count.ln()),
                visible: bench.dictionary.families[family].visible,
                in_set,
                variant: cause
                    .as_ref()
                    .and_then(|c| description.variant_name(bench.model, &c.shape)),
                parameters: if cause.is_some() {
                    parameters(bench, readings, &beside, which)
                        .into_iter()
                        .map(Into::into)
                        .collect()
                } else {
                    Vec::new()
                },
                physics: about.physics.to_owned(),
                confirm: about.confirm.to_owned(),
            },
        ));
    }
    list.sort_by(|a, b| {
        (b.1.in_set, b.0)
            .partial_cmp(&(a.1.in_set, a.0))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    list.into_iter().map(|(_, c)| c).collect()
}
