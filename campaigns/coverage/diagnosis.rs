//! The diagnosis of every model: the gap before and after, the sizes of effects, what the answer is
//! and by how much it moves. Data are those of the blind tests, effects in exact form at random sizes
//! from 1.5 to 6 times what such data show.

#[path = "../../tests/other_models/mod.rs"]
pub mod other_models;
#[path = "../../tests/scene/mod.rs"]
mod scene;

use errsep::diagnosis::{Diagnosis, Kind, Options, Size, diagnose};
use errsep_models::model::FittedModel;
use errsep_models::reversal::Channel;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::Injection;
use nalgebra::{DMatrix, DVector};
use other_models::{MAKERS, Put, told_of_put, within};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::tally::{Row, Tally};

/// Quantile of a 95 % interval.
const Q95: f64 = 1.959_963_984_540_054;

/// Effects of the reversal whose parameter is the size put in.
const REVERSAL: [&str; 4] = ["gain-mismatch", "reversal-shift", "taper", "zero-jump"];

fn options() -> Options {
    Options {
        draws: 400,
        ..Options::default()
    }
}

/// All rows; `cases` with each effect, as many with none.
pub fn rows(cases: u64) -> Vec<Row> {
    let effects = |model: &str| {
        let maker = MAKERS.iter().find(|m| m.model == model);
        maker.map_or(&[][..], |m| m.effects)
    };
    let mut rows = Vec::new();
    rows.extend(counted("reversal", &REVERSAL, cases, &reversal));
    let line = "calibration-line";
    let make = other_models::calibration_line_made;
    rows.extend(counted(line, effects(line), cases, &make));
    let make = other_models::circle_made;
    rows.extend(counted("circle", effects("circle"), cases, &make));
    let make = other_models::four_sensor_made;
    rows.extend(counted("four-sensor", effects("four-sensor"), cases, &make));
    let make = other_models::fourier_made;
    rows.extend(counted("fourier", effects("fourier"), cases, &make));
    let steps = "step-diagonal";
    let make = other_models::step_diagonal_made;
    rows.extend(counted(steps, effects(steps), cases, &make));
    let make = other_models::machine_made;
    rows.extend(counted("machine", effects("machine"), cases, &make));
    let mut names: Vec<String> = Vec::new();
    for row in &rows {
        if !names.contains(&row.quantity) {
            names.push(row.quantity.clone());
        }
    }
    let pooled = names.iter().map(|name| {
        let own = rows.iter().filter(|row| row.quantity == *name);
        own.fold(row("all models", name, 0, Tally::default()), |sum, own| {
            Row {
                seeds: sum.seeds + own.seeds,
                tally: sum.tally.and(own.tally),
                ..sum
            }
        })
    });
    let pooled: Vec<Row> = pooled.collect();
    rows.extend(pooled);
    rows
}

fn row(case: &str, quantity: &str, seeds: u64, tally: Tally) -> Row {
    Row {
        case: case.to_owned(),
        quantity: quantity.to_owned(),
        seeds,
        tally,
    }
}

/// What one case adds.
#[derive(Default)]
struct Counts([Tally; 7]);

const QUANTITIES: [&str; 7] = [
    "gap before",
    "gap before, nothing there",
    "gap after, right effect named",
    "size of the effect",
    "answer before",
    "answer after",
    "answer moved",
];

fn counted<M: FittedModel + 'static>(
    model: &str,
    effects: &[&str],
    cases: u64,
    make: &(impl Fn(Put<'_>, u64, f64) -> M + Sync),
) -> Vec<Row> {
    let absorbed = absorbed(&make(&[], 1, 1.0));
    let bare = diagnose(&make(&[], 1, 1.0), &options());
    let jobs: Vec<(Option<(&str, f64)>, u64)> = (0..cases)
        .flat_map(|case| {
            let seen = effects.iter().enumerate().filter_map(|(k, effect)| {
                let hidden = bare.hidden.iter().find(|h| h.effect == *effect)?;
                let mut random = ChaCha8Rng::seed_from_u64(100 * case + k as u64);
                let size = hidden.detectable? * (1.5 + 4.5 * random.random::<f64>());
                Some((Some((*effect, size)), 1000 * (k as u64 + 1) + case))
            });
            let mut jobs: Vec<_> = seen.collect();
            jobs.push((None, 500_000 + case));
            jobs
        })
        .collect();
    let all: Vec<Counts> = jobs
        .par_iter()
        .map(|(put, seed)| one(*put, *seed, make, &absorbed))
        .collect();
    let rows = QUANTITIES.iter().enumerate().map(|(k, name)| {
        let tally = all.iter().fold(Tally::default(), |sum, c| sum.and(c.0[k]));
        let seeds = all.iter().filter(|c| c.0[k].any()).count() as u64;
        row(model, name, seeds, tally)
    });
    rows.filter(|row| row.seeds > 0).collect()
}

fn one<M: FittedModel + 'static>(
    put: Option<(&str, f64)>,
    seed: u64,
    make: &impl Fn(Put<'_>, u64, f64) -> M,
    absorbed: &DMatrix<f64>,
) -> Counts {
    let mut counts = Counts::default();
    let effects: Vec<(&str, f64)> = put.into_iter().collect();
    let diagnosis = diagnose(&make(&effects, seed, 1.0), &options());
    let (exact, clean) = (make(&effects, seed, 0.0), make(&[], seed, 0.0));
    let truth = left(&exact, absorbed);
    let Some((effect, size)) = put else {
        gap(&mut counts.0[1], diagnosis.gap.before, 0.0);
        answers(&mut counts, &diagnosis, &exact, &clean);
        return counts;
    };
    gap(&mut counts.0[0], diagnosis.gap.before, truth);
    let verdict = &diagnosis.verdict;
    let right = verdict.kind == Kind::Effect
        && verdict.effects == [effect]
        && verdict.indistinguishable.is_empty();
    if right && within(&diagnosis, effect, size).is_some() {
        gap(&mut counts.0[2], diagnosis.gap.after, 0.0);
        sized(&mut counts.0[3], &diagnosis, effect, size);
        answers(&mut counts, &diagnosis, &exact, &clean);
    }
    counts
}

/// Counts an interval of a gap; its error is that of the square, in which the interval is even.
fn gap(tally: &mut Tally, size: Size, truth: f64) {
    let [low, high] = size.ci95;
    let half = high * high - size.rms * size.rms;
    let inside = low <= truth && truth <= high;
    tally.add_intervals(
        truth * truth - size.rms * size.rms,
        half / Q95,
        half / Q95,
        if inside { f64::INFINITY } else { -1.0 },
    );
}

fn sized(tally: &mut Tally, diagnosis: &Diagnosis, effect: &str, size: f64) {
    let size = size * told_of_put(diagnosis.model, effect);
    let candidate = diagnosis.candidates.iter().find(|c| c.effect == effect);
    if let Some(found) = candidate.and_then(|c| c.parameters.first()) {
        tally.add(found.value.abs() - size, found.std, freedom(diagnosis));
    }
}

/// Degrees of freedom of the noise, which every standard uncertainty shares.
fn freedom(diagnosis: &Diagnosis) -> f64 {
    diagnosis.noise.degrees_of_freedom.unwrap_or(f64::INFINITY)
}

/// The numbers people act on: before, with the effect in them; after, without it.
fn answers<M: FittedModel + 'static>(
    counts: &mut Counts,
    diagnosis: &Diagnosis,
    exact: &M,
    clean: &M,
) {
    let (with, without) = (exact.linearised(), clean.linearised());
    let freedom = freedom(diagnosis);
    for quantity in clean.quantities() {
        let Some(bias) = diagnosis.bias.iter().find(|b| b.quantity == quantity.name) else {
            continue;
        };
        let (before, after) = (quantity.weights.dot(&with), quantity.weights.dot(&without));
        let moved = after - before;
        // What is told from the circle through the readings has no truth of its own.
        if exact.name() != "circle" {
            counts.0[4].add(bias.before - before, bias.std, freedom);
            if moved != 0.0 {
                counts.0[5].add(bias.after - after, bias.after_std, freedom);
            }
        }
        // What hardly moves says nothing of how well its move is known.
        if moved.abs() > 0.1 * bias.std && exact.name() != "circle" {
            counts.0[6].add(bias.moved - moved, bias.moved_std, freedom);
        }
    }
}

/// Orthonormal columns of what a fit absorbs, by their singular values.
fn absorbed<M: FittedModel + 'static>(model: &M) -> DMatrix<f64> {
    let freedom = model.freedom();
    let mut columns: Vec<DVector<f64>> = freedom
        .columns
        .column_iter()
        .map(|c| c.clone_owned())
        .collect();
    if let Some(profiles) = &freedom.profiles {
        let length = model
            .traces()
            .first()
            .map_or(0, std::iter::ExactSizeIterator::len);
        for function in 0..profiles.patterns.ncols() {
            let mut allowed = DMatrix::<f64>::identity(length, length);
            for (own, profile) in &profiles.withheld {
                if *own == function {
                    allowed -= profile * profile.transpose() / profile.norm_squared();
                }
            }
            for profile in allowed.column_iter() {
                let mut column = DVector::zeros(model.observed().len());
                for (t, trace) in model.traces().iter().enumerate() {
                    let seen = profile * profiles.patterns[(t, function)];
                    column.rows_mut(trace.start, length).copy_from(&seen);
                }
                columns.push(column);
            }
        }
    }
    if columns.is_empty() {
        return DMatrix::zeros(model.observed().len(), 0);
    }
    for column in &mut columns {
        let length = column.norm();
        if length > 0.0 {
            *column /= length;
        }
    }
    let factor = DMatrix::from_columns(&columns).svd(true, false);
    let rank = factor.rank(1e-9 * factor.singular_values.amax());
    let mut order: Vec<usize> = (0..factor.singular_values.len()).collect();
    order.sort_by(|a, b| factor.singular_values[*b].total_cmp(&factor.singular_values[*a]));
    order.truncate(rank);
    factor
        .u
        .map_or_else(|| DMatrix::zeros(0, 0), |u| u.select_columns(&order))
}

/// What a model leaves of readings without noise: root of the sum of squares over the degrees of
/// freedom.
fn left<M: FittedModel + 'static>(model: &M, absorbed: &DMatrix<f64>) -> f64 {
    let readings = model.linearised();
    let residual = &readings - absorbed * absorbed.tr_mul(&readings);
    (residual.norm_squared() / (readings.len() - absorbed.ncols()) as f64).sqrt()
}

/// Sixty positions, four repeats, both directions.
fn reversal(put: Put<'_>, seed: u64, noise: f64) -> Linearised {
    let mut truth = scene::scene(seed, 3e-5);
    for (name, size) in put {
        truth.effects.push(match *name {
            "gain-mismatch" => Injection::GainMismatch(*size),
            "reversal-shift" => Injection::ReversalShift(*size),
            "taper" => Injection::Taper(*size),
            _ => Injection::ZeroJump {
                jump: *size,
                channel: Channel::C2B,
                time: 0.7 * truth.duration(),
            },
        });
    }
    let observations = if noise > 0.0 {
        truth.measured(seed)
    } else {
        truth.exact()
    };
    Linearised::new(&observations, Assumptions::default())
        .unwrap_or_else(|e| unreachable!("a complete reversal: {e}"))
}
