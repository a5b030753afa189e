//! Which effect: a confidence set, not a winner.
//!
//! A cause is accepted when, refitted with everything else free, it leaves nothing that stands out
//! of the noise: no other effect, no place. All causes that pass are the confidence set (the
//! inversion of the test); significance alone names nothing. One cause is tried first, then two,
//! then three; each further one must earn its place beside the others.

use errsep_models::model::{FittedModel, Shape};
use nalgebra::DVector;

use super::bench::{Bench, Cause, Remainder, adequate, finer, raw_signatures};
use super::noise::{NoiseLaw, NoiseSource};
use super::quantify::held_out_square;
use super::space::{Space, orthonormal};

/// A further cause must stand out beside the others at this level.
const EARNED: f64 = 0.002;
/// Part of the strongest cause's change, squared, that a further one must reach. What is less may be
/// the remainder of a cause taken for another whose signature is off by a seventh of its size.
const WEIGHTY: f64 = 0.02;
/// A swap must raise the statistic by more than what searches leave open.
const BETTER: f64 = 0.01;
/// A cause whose statistic is this much below the best cannot be adequate.
const HOPELESS: f64 = 80.0;
/// Causes whose misfits differ by less fit equally well: the one of more usual size goes first.
const TIED: f64 = 9.2;
/// Number of pairs that are fitted with everything else free.
const PAIRS: usize = 3;
/// Greatest number of effects in one verdict.
const MOST: usize = 3;

/// Causes that together explain the gap, and those that do it as well.
pub(super) struct Answer {
    /// The causes, by what each adds.
    pub causes: Vec<Cause>,
    /// For each cause the effects that these data cannot tell from it, itself first.
    pub groups: Vec<Vec<usize>>,
    /// What remains beside them.
    pub remainder: Remainder,
    /// Whether the remainder is adequate.
    pub complete: bool,
}

/// Seeks the causes of what stands out in readings.
pub(super) fn attribute<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    first: &Remainder,
) -> Option<Answer> {
    let mut causes: Vec<Cause> = Vec::new();
    let mut partial: Option<Answer> = None;
    for size in 1..=MOST {
        let here = partial.as_ref().map_or(first, |answer| &answer.remainder);
        let Some(next) = strongest(bench, readings, here, &causes) else {
            break;
        };
        causes.push(next);
        if size > 1 {
            polish(bench, readings, &mut causes);
        }
        let answer = confidence_set(bench, readings, &causes);
        if answer.complete {
            return Some(answer);
        }
        causes.clone_from(&answer.causes);
        partial = Some(answer);
    }
    let least = partial.as_ref().map_or(f64::INFINITY, |answer| {
        answer.remainder.residual.norm_squared() + HOPELESS
    });
    pairs(bench, readings, first)
        .into_iter()
        .filter(|causes| {
            bench.misfit(readings, &bench.relinearised(readings, causes, least)) < least
        })
        .map(|causes| confidence_set(bench, readings, &causes))
        .find(|answer| answer.complete)
        .or(partial)
}

/// The causes without which noise and state cannot be had: by strength, each refitted, no others
/// tried in their place.
pub(super) fn roughly<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    first: &Remainder,
) -> Vec<Cause> {
    let mut causes: Vec<Cause> = Vec::new();
    let mut left: Option<Remainder> = None;
    for _ in 0..MOST {
        let here = left.as_ref().unwrap_or(first);
        let Some(next) = strongest(bench, readings, here, &causes) else {
            break;
        };
        causes.push(next);
        if causes.len() > 1 {
            polish(bench, readings, &mut causes);
        }
        causes = bench.relinearised(readings, &causes, f64::INFINITY);
        let remainder = bench.judged(readings, &causes);
        if adequate(&causes, &remainder) {
            break;
        }
        left = Some(remainder);
    }
    causes
}

/// Pairs of effects of which each stands out beside the other though neither need do so alone, the
/// best fits first.
fn pairs<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    first: &Remainder,
) -> Vec<Vec<Cause>> {
    let mut found: Vec<(f64, Vec<Cause>)> = Vec::new();
    for effect in 0..bench.catalogue.len() {
        let Some(start) = bench.start(first, effect) else {
            continue;
        };
        let one = vec![bench.cause(bench.model, effect, start.clone())];
        let beside = bench.remainder(readings, &one);
        for other in effect + 1..bench.catalogue.len() {
            if bench.p_value(&beside, other) > EARNED {
                continue;
            }
            let Some(start) = bench.start(&beside, other) else {
                continue;
            };
            let second = bench.cause(bench.model, other, start.clone());
            let pair = vec![one[0].clone(), second];
            found.push((bench.misfit(readings, &pair), pair));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Coarse fits further above the best than this cannot become the best by refining.
    let reach = found.first().map_or(0.0, |(least, _)| 1.3 * least);
    found.retain(|(misfit, _)| *misfit <= reach);
    found.truncate(PAIRS);
    let polished = found.into_iter().map(|(_, mut pair)| {
        polish(bench, readings, &mut pair);
        pair
    });
    polished.collect()
}

/// The refined effect with the greatest statistic beside the causes.
fn strongest<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    remainder: &Remainder,
    causes: &[Cause],
) -> Option<Cause> {
    let mut ranked: Vec<(f64, usize)> = (0..bench.catalogue.len())
        .filter(|effect| causes.iter().all(|c| c.effect != *effect))
        .filter(|effect| bench.p_value(remainder, *effect) < EARNED)
        .filter_map(|effect| {
            let family = bench.family_of(effect)?;
            Some((remainder.best[family].0, effect))
        })
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked
        .into_iter()
        .take(5)
        .filter_map(|(_, effect)| {
            let start = bench.start(remainder, effect)?;
            let (cause, t) = bench.refine(bench.model, readings, effect, start, causes);
            possible(bench, readings, causes, &cause).then_some((cause, t))
        })
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(cause, _)| cause)
}

/// Whether a cause beside others has a physically possible size.
fn possible<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    others: &[Cause],
    cause: &Cause,
) -> bool {
    let mut all = others.to_vec();
    all.push(cause.clone());
    let Some((amplitudes, covariance)) = bench.amplitudes(readings, &all) else {
        return false;
    };
    let own = cause.projected.ncols();
    let from = amplitudes.len() - own;
    let stds: Vec<f64> = (from..amplitudes.len())
        .map(|k| covariance[(k, k)].max(0.0).sqrt())
        .collect();
    bench.plausible(cause, &amplitudes.as_slice()[from..], &stds)
}

/// Refines each cause beside the others, and swaps it for any effect that explains more, itself
/// begun elsewhere among them.
fn polish<M: FittedModel>(bench: &Bench<'_, M>, readings: &DVector<f64>, causes: &mut [Cause]) {
    for _ in 0..3 {
        let mut changed = false;
        for k in 0..causes.len() {
            let others = without(causes, k);
            let start = finer(&causes[k].shape);
            let (refined, t) =
                bench.refine(bench.model, readings, causes[k].effect, &start, &others);
            let remainder = bench.remainder(readings, &others);
            let swapped = strongest(bench, readings, &remainder, &others)
                .map(|c| bench.refine(bench.model, readings, c.effect, &finer(&c.shape), &others));
            match swapped {
                Some((other, other_t)) if other_t > t + BETTER => {
                    causes[k] = other;
                    changed = true;
                }
                _ => {
                    changed |= refined.shape.values != causes[k].shape.values;
                    causes[k] = refined;
                }
            }
        }
        if !changed {
            break;
        }
    }
}

fn without(causes: &[Cause], k: usize) -> Vec<Cause> {
    let mut others = causes.to_vec();
    others.remove(k);
    others
}

/// One way to explain the gap: causes with one of them varied.
struct Member {
    effect: usize,
    causes: Vec<Cause>,
    misfit: f64,
    left: Remainder,
    /// Size as a part of what is physically plausible.
    size: f64,
}

/// All effects that could stand in place of each cause, the others kept.
fn confidence_set<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    causes: &[Cause],
) -> Answer {
    let mut best = bench.relinearised(readings, causes, f64::INFINITY);
    let mut remainder = bench.judged(readings, &best);
    let mut groups = Vec::new();
    for k in 0..causes.len() {
        let members = alternatives(bench, readings, &best, k);
        let group = if members.is_empty() {
            vec![best[k].effect]
        } else {
            members.iter().map(|m| m.effect).collect()
        };
        groups.push(group);
        if let Some(first) = members.into_iter().next() {
            best = first.causes;
            remainder = first.left;
        }
    }
    let needed = best.len() == 1
        || weighty(bench, readings, &best)
            && (0..best.len()).all(|k| {
                let beside = bench.remainder(readings, &without(&best, k));
                bench.p_value(&beside, best[k].effect) < EARNED
            })
            && predicts(bench, readings, &best);
    Answer {
        complete: needed && adequate(&best, &remainder),
        causes: best,
        groups,
        remainder,
    }
}

/// Whether each of several causes, beside the others, changes the readings by more than may be left
/// of the strongest of them because its signature is not quite that of the true cause. Counted in
/// the readings' own unit, as signatures differ, and not by the noise, under which a slow change
/// shows less; of the strongest all that shows, as that is what a wrong signature errs by.
fn weighty<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    causes: &[Cause],
) -> bool {
    let Some(changes) = bench.changes(readings, causes) else {
        return false;
    };
    let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
    let shown = Space::new(bench.model, &unit).forward(changes).0;
    let sizes: Vec<f64> = shown.column_iter().map(|c| c.norm()).collect();
    let own: Vec<f64> = (0..causes.len())
        .map(|k| {
            let mut others = sizes.clone();
            others.remove(k);
            let basis = orthonormal(&shown.clone().remove_column(k), &others);
            let change = shown.column(k);
            (change - &basis * basis.tr_mul(&change)).norm_squared()
        })
        .collect();
    let most = sizes.iter().map(|size| size * size).fold(0.0, f64::max);
    own.iter().all(|square| *square > WEIGHTY * most)
}

/// Whether each of several causes makes the prediction of held-out repeats better; a cause that
/// happened once cannot be judged so.
fn predicts<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    causes: &[Cause],
) -> bool {
    let noise = bench.law.sigma().powi(2);
    let square = |causes: &[Cause]| {
        let signatures = raw_signatures(bench, causes);
        held_out_square(bench.model, readings, &signatures, noise)
    };
    let Some(with) = square(causes) else {
        return true;
    };
    (0..causes.len()).all(|k| square(&without(causes, k)).is_none_or(|s| s > with))
}

/// The effects that are adequate in the place of cause `k`, the best fit first.
fn alternatives<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    best: &[Cause],
    k: usize,
) -> Vec<Member> {
    let others = without(best, k);
    let remainder = bench.remainder(readings, &others);
    let strength = |cause: &Cause| {
        let mut all = others.clone();
        all.push(cause.clone());
        remainder.residual.norm_squared() - bench.misfit(readings, &all)
    };
    let own = strength(&best[k]);
    let least = bench.misfit(readings, best) + HOPELESS + 0.1 * own;
    let mut members = Vec::new();
    for effect in 0..bench.catalogue.len() {
        if others.iter().any(|c| c.effect == effect) {
            continue;
        }
        let trials = if effect == best[k].effect {
            let turned = turned(bench, &best[k]);
            let other = turned.map(|shape| {
                bench
                    .refine(bench.model, readings, effect, &shape, &others)
                    .0
            });
            vec![Some(best[k].clone()), other]
        } else {
            if bench.p_value(&remainder, effect) > EARNED {
                continue;
            }
            let start = bench.start(&remainder, effect);
            vec![start.map(|start| {
                bench
                    .refine(bench.model, readings, effect, start, &others)
                    .0
            })]
        };
        let judged = trials.into_iter().flatten().filter_map(|cause| {
            if strength(&cause) < own - HOPELESS - 0.1 * own
                || !possible(bench, readings, &others, &cause)
            {
                return None;
            }
            let known = cause.shape == best[k].shape && effect == best[k].effect;
            let mut trial = others.clone();
            trial.insert(k, cause);
            let trial = if known {
                trial
            } else {
                bench.relinearised(readings, &trial, least)
            };
            let left = bench.judged(readings, &trial);
            adequate(&trial, &left).then(|| Member {
                effect,
                size: part_of_plausible(bench, readings, &trial, k),
                causes: trial,
                misfit: left.residual.norm_squared(),
                left,
            })
        });
        members.extend(judged.min_by(|a, b| a.misfit.total_cmp(&b.misfit)));
    }
    let least = members
        .iter()
        .map(|m| m.misfit)
        .fold(f64::INFINITY, f64::min);
    members.sort_by(|a, b| {
        let behind = |m: &Member| m.misfit > least + TIED;
        let by_fit = a.misfit.total_cmp(&b.misfit);
        let by_size = a.size.total_cmp(&b.size);
        behind(a).cmp(&behind(b)).then(if behind(a) {
            by_fit
        } else {
            by_size.then(by_fit)
        })
    });
    members
}

/// The shape of a cause in the other of two variants, which a state bent by the first may hide.
fn turned<M: FittedModel>(bench: &Bench<'_, M>, cause: &Cause) -> Option<Shape> {
    let effect = &bench.catalogue[cause.effect];
    let grid = effect.grid(bench.model);
    if grid.iter().any(|shape| shape.variant > 1) {
        return None;
    }
    let other = 1 - cause.shape.variant;
    let start = grid.into_iter().find(|shape| shape.variant == other)?;
    let same = Shape {
        values: cause.shape.values.clone(),
        ..start
    };
    (same.values.len() == same.steps.len() && effect.allowed(bench.model, &same)).then_some(same)
}

/// The greatest amplitude of a cause as a part of the plausible one.
fn part_of_plausible<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    causes: &[Cause],
    k: usize,
) -> f64 {
    let Some((amplitudes, _)) = bench.amplitudes(readings, causes) else {
        return f64::INFINITY;
    };
    let from: usize = causes[..k].iter().map(|c| c.projected.ncols()).sum();
    bench.catalogue[causes[k].effect]
        .amplitudes()
        .iter()
        .zip(amplitudes.iter().skip(from))
        .map(|(p, a)| a.abs() / p.low.abs().max(p.high.abs()))
        .fold(0.0, f64::max)
}
