//! Puts what was found into the verdict's words and tables.

use errsep_models::model::{Estimate, FittedModel, Shape};
use nalgebra::{DMatrix, DVector};

use super::Options;
use super::attribute::Answer;
use super::bench::{Bench, Cause, Remainder};
use super::dictionary::{Meaning, statistic};
use super::noise::NoiseSource;
use super::quantify::{GapMeter, biases, shrink, weighted_std};
use super::verdict::{
    Candidate, Detail, Diagnosis, Gap, Harm, Hidden, Kind, NoiseOut, Verdict, Where,
};

use crate::report::number::{measured, plain};

/// Effects of which less than this part is visible are called undetectable; so are those that would
/// show only at a size that is not plausible.
const UNDETECTABLE: f64 = 1e-3;
/// Places that are not reported beyond this probability.
const PLACE_LEVEL: f64 = 0.05;
/// Normal quantile of 80 % power.
const POWER: f64 = 0.8416;

pub(super) fn compose<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    first: &Remainder,
    detected: f64,
    found: Option<Answer>,
    options: &Options,
) -> Diagnosis {
    let alarmed = detected <= options.false_alarm;
    let complete = alarmed && found.as_ref().is_some_and(|a| a.complete);
    let kind = match (alarmed, complete) {
        (false, _) => Kind::None,
        (true, true) => Kind::Effect,
        (true, false) => Kind::Unknown,
    };
    let causes: &[Cause] = match (&found, kind) {
        (Some(answer), Kind::Effect | Kind::Unknown) => &answer.causes,
        _ => &[],
    };
    let fit = bench.amplitudes(readings, causes);
    let change = fit.as_ref().map_or_else(
        || DVector::zeros(readings.len()),
        |(amplitudes, _)| bench.change(causes, amplitudes),
    );
    let meter = GapMeter::new(bench.model, &bench.law, options.seed);
    let unknowns: usize = causes
        .iter()
        .map(|c| c.projected.ncols() + c.shape.values.len())
        .sum();
    let before = meter.size(readings, 0);
    let after = meter.size(&(readings - &change), unknowns);
    let signatures = raw_signatures(bench, causes);
    let excess = (first.residual.norm_squared() - bench.space.degrees_of_freedom() as f64)
        .max(f64::MIN_POSITIVE);
    let explained =
        first.residual.norm_squared() - bench.remainder(readings, causes).residual.norm_squared();
    let gap = Gap {
        unit: bench.model.reading_unit(),
        noise: bench.law.sigma(),
        before,
        after,
        shrink: shrink(before.rms, after.rms),
        predicted_shrink: 1.0 - (1.0 - explained / excess).max(0.0).sqrt(),
        held_out: meter.held_out(bench.model, readings, &signatures),
    };
    let candidates = candidates(bench, readings, first, excess, found.as_ref(), causes);
    let names = |effects: &[usize]| -> Vec<String> {
        effects
            .iter()
            .map(|e| bench.catalogue[*e].name().to_owned())
            .collect()
    };
    let own: Vec<usize> = causes.iter().map(|c| c.effect).collect();
    let groups: Vec<Vec<String>> = match (&found, kind) {
        (Some(answer), Kind::Effect) => answer
            .groups
            .iter()
            .filter(|g| g.len() > 1)
            .map(|g| names(g))
            .collect(),
        _ => Vec::new(),
    };
    let places = if alarmed {
        places(bench, first, excess)
    } else {
        Vec::new()
    };
    let mut verdict = Verdict {
        kind,
        effects: if kind == Kind::Effect {
            names(&own)
        } else {
            Vec::new()
        },
        indistinguishable: groups,
        partial: if kind == Kind::Unknown {
            names(&own)
        } else {
            Vec::new()
        },
        statement: String::new(),
        p_value: detected,
        adequacy: found.as_ref().map_or(first.global, |a| a.adequacy),
    };
    let hidden = hidden(bench, &verdict.effects, options);
    verdict.statement = statement(&verdict, &gap, &places, &candidates, &hidden);
    let (bias, profiles) = biases(bench.model, &bench.law, readings, &change);
    Diagnosis {
        schema: "errsep.diagnosis/1",
        model: bench.model.name(),
        verdict,
        gap,
        noise: NoiseOut::from(&bench.law),
        places,
        candidates,
        bias,
        hidden,
        notes: notes(bench),
        detail: Detail {
            before: meter.residuals(readings),
            after: meter.residuals(&(readings - &change)),
            profiles,
            change: change.as_slice().to_vec(),
        },
    }
}

fn notes<M: FittedModel>(bench: &Bench<'_, M>) -> Vec<String> {
    let mut notes = Vec::new();
    if bench.law.source == NoiseSource::Neighbours {
        notes.push(
            "The noise is not measured: there are no repeats. It is taken from differences of neighbouring readings, so anything rougher than the spacing counts as noise; measure at least three repeats."
                .to_owned(),
        );
    } else if bench.law.source == NoiseSource::Stated {
        notes.push("The noise is not measured but stated in the set-up.".to_owned());
    }
    notes
}

/// Signatures as they stand in the readings, readings × amplitudes.
fn raw_signatures<M: FittedModel>(bench: &Bench<'_, M>, causes: &[Cause]) -> DMatrix<f64> {
    let n = bench.space.readings();
    let columns: Vec<DVector<f64>> = causes
        .iter()
        .flat_map(|c| &c.columns)
        .map(|c| c.dense(n))
        .collect();
    if columns.is_empty() {
        DMatrix::zeros(n, 0)
    } else {
        DMatrix::from_columns(&columns)
    }
}

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
    bench.catalogue[causes[which].effect].estimates(
        &causes[which].shape,
        &amplitudes.as_slice()[own.1..own.1 + count],
        &covariance,
    )
}

fn candidates<M: FittedModel>(
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
            let unknowns = c.projected.ncols() + c.shape.values.len();
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

/// The strongest place on every axis, and the channels' shares.
fn places<M: FittedModel>(bench: &Bench<'_, M>, first: &Remainder, excess: f64) -> Vec<Where> {
    let interval = |t: f64| {
        let reach = 1.96 * 2.0 * t.sqrt() / excess;
        let share = (t / excess).clamp(0.0, 1.0);
        (share, [(share - reach).max(0.0), (share + reach).min(1.0)])
    };
    let mut places = Vec::new();
    for (k, family) in bench.dictionary.families.iter().enumerate() {
        let (surprise, Some(entry)) = first.best[k] else {
            continue;
        };
        let p = bench.null.family(k, surprise);
        if family.is_effect || p > PLACE_LEVEL {
            continue;
        }
        let entry = &bench.dictionary.entries[entry];
        if let Meaning::Place(item) = &entry.meaning {
            let adjoint = bench
                .space
                .adjoint(DMatrix::from_column_slice(
                    first.residual.len(),
                    1,
                    first.residual.as_slice(),
                ))
                .column(0)
                .clone_owned();
            let score = super::dictionary::products(&entry.columns, &adjoint);
            let t = statistic(&entry.gram, &score, false);
            let (share, ci) = interval(t);
            places.push(Where::new(item, share, ci, p));
        }
    }
    places.extend(channels(bench, first, excess));
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places.truncate(6);
    places
}

/// The part of the gap in each channel.
fn channels<M: FittedModel>(bench: &Bench<'_, M>, first: &Remainder, excess: f64) -> Vec<Where> {
    let names = bench.model.channel_names();
    let count = names.len();
    if count < 2 {
        return Vec::new();
    }
    let mut sums = vec![(0.0, 0.0); count];
    for (place, e) in bench.model.places().iter().zip(first.residual.iter()) {
        sums[place.channel].0 += e * e;
        sums[place.channel].1 += 1.0;
    }
    let kept = bench.space.degrees_of_freedom() as f64 / bench.space.readings() as f64;
    sums.into_iter()
        .zip(names)
        .filter_map(|((sum, readings), name)| {
            let freedom = (readings * kept).max(1.0);
            let tail = statrs::function::gamma::checked_gamma_ur(freedom / 2.0, sum / 2.0).ok()?;
            let p = (tail * count as f64).min(1.0);
            let share = ((sum - freedom) / excess).clamp(0.0, 1.0);
            let reach = 1.96 * (2.0 * freedom + 4.0 * (sum - freedom).max(0.0)).sqrt() / excess;
            (p < PLACE_LEVEL).then(|| Where {
                axis: "channel",
                value: name,
                from: None,
                to: None,
                share,
                share_ci95: [(share - reach).max(0.0), (share + reach).min(1.0)],
                p_value: p,
            })
        })
        .collect()
}

/// What these readings would not have shown, for every effect that is not named.
fn hidden<M: FittedModel>(
    bench: &Bench<'_, M>,
    named: &[String],
    options: &Options,
) -> Vec<Hidden> {
    let quantities: Vec<_> = bench
        .model
        .quantities()
        .into_iter()
        .map(|q| {
            let std = weighted_std(bench.model, &bench.law, &q.weights);
            (q, std)
        })
        .collect();
    let mut list = Vec::new();
    for (effect, description) in bench.catalogue.iter().enumerate() {
        if named.iter().any(|n| n == description.name()) {
            continue;
        }
        let Some(family) = bench.family_of(effect) else {
            continue;
        };
        let visible = bench.dictionary.families[family].visible;
        let entries = &bench.dictionary.entries[bench.dictionary.families[family].entries.clone()];
        let gram = entries.iter().map(|e| e.gram[(0, 0)]).fold(0.0, f64::max);
        let threshold = bench.null.threshold(family, options.false_alarm);
        let most = description
            .amplitudes()
            .first()
            .map_or(f64::INFINITY, |p| p.low.abs().max(p.high.abs()));
        let detectable = (visible >= UNDETECTABLE && gram > 0.0)
            .then(|| (threshold.sqrt() + POWER) / gram.sqrt())
            .filter(|size| *size <= most);
        let shape = description.grid(bench.model).into_iter().next();
        let column = shape
            .and_then(|s| description.columns(bench.model, &s).into_iter().next())
            .map(|c| c.dense(bench.space.readings()));
        let harm = column.and_then(|column| {
            quantities
                .iter()
                .map(|(q, std)| (q, q.weights.dot(&column), *std))
                .max_by(|a, b| (a.1.abs() / a.2).total_cmp(&(b.1.abs() / b.2)))
                .map(|(q, per_unit, _)| Harm {
                    quantity: q.name.clone(),
                    per_unit,
                    unit: q.unit.to_owned(),
                })
        });
        list.push(Hidden {
            effect: description.name().to_owned(),
            visible,
            detectable,
            unit: description
                .amplitudes()
                .first()
                .map_or(String::new(), |p| p.unit.to_owned()),
            harm,
        });
    }
    list.sort_by(|a, b| a.visible.total_cmp(&b.visible));
    list
}

fn statement(
    verdict: &Verdict,
    gap: &Gap,
    places: &[Where],
    candidates: &[Candidate],
    hidden: &[Hidden],
) -> String {
    let unit = gap.unit;
    let undetectable: Vec<&str> = hidden
        .iter()
        .filter(|h| h.detectable.is_none())
        .map(|h| h.effect.as_str())
        .collect();
    let place = places.first().map_or(String::new(), |p| {
        let range = match (p.from, p.to) {
            (Some(from), Some(to)) => format!(" from {} to {}", plain(from, 4), plain(to, 4)),
            _ => String::new(),
        };
        format!(", most of it in {} {}{range}", p.axis, p.value)
    });
    match verdict.kind {
        Kind::None => {
            let blind = if undetectable.is_empty() {
                String::new()
            } else {
                format!(
                    "; {} would not show in such readings whatever their size",
                    undetectable.join(", ")
                )
            };
            format!(
                "The model misses nothing that stands out of the noise of {} {unit}{blind}.",
                plain(gap.noise, 3)
            )
        }
        Kind::Unknown => format!(
            "The model misses {} {unit} RMS{place}, and no effect of the catalogue explains it.",
            plain(gap.before.rms, 3)
        ),
        Kind::Effect => {
            let named: Vec<String> = verdict
                .effects
                .iter()
                .map(|name| {
                    let detail = candidates
                        .iter()
                        .find(|c| c.effect == *name)
                        .map_or(String::new(), describe);
                    format!("{name}{detail}")
                })
                .collect();
            let doubt = if verdict.indistinguishable.is_empty() {
                let confirm: Vec<&str> = candidates
                    .iter()
                    .filter(|c| verdict.effects.contains(&c.effect))
                    .map(|c| c.confirm.as_str())
                    .collect();
                format!("To confirm: {}.", confirm.join("; "))
            } else {
                let groups: Vec<String> = verdict
                    .indistinguishable
                    .iter()
                    .map(|g| g.join(" or "))
                    .collect();
                format!(
                    "These readings cannot tell apart {}.",
                    groups.join(", nor ")
                )
            };
            format!(
                "The model misses {} {unit} RMS because of {}; with it {} {unit} remain. {doubt}",
                plain(gap.before.rms, 3),
                named.join(" and "),
                plain(gap.after.rms, 3)
            )
        }
    }
}

fn describe(candidate: &Candidate) -> String {
    let mut parts: Vec<String> = candidate.variant.iter().cloned().collect();
    parts.extend(
        candidate
            .parameters
            .iter()
            .map(|p| format!("{} {} {}", p.name, measured(p.value, Some(p.std)), p.unit)),
    );
    format!(" ({})", parts.join(", "))
}
