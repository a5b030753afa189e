//! Effects that are given with `--with` to the commands of the other models and to `errsep diagnose`: their
//! sizes, and the answer with them. Data are those of the blind tests, effects in exact form at random
//! sizes from a half to 6 times what such data show: nothing is named, so that small ones count too.

use errsep::diagnosis::{Joined, Options, joined};
use errsep_models::model::FittedModel;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::diagnosis::other_models::{self, MAKERS, Put, seen_from, told_of_put};
use super::tally::{Row, Tally};

fn options() -> Options {
    Options {
        draws: 100,
        ..Options::default()
    }
}

/// All rows; so many seeds each effect.
pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    rows.extend(of(
        "calibration-line",
        seeds,
        &other_models::calibration_line_made,
    ));
    rows.extend(of("circle", seeds, &other_models::circle_made));
    rows.extend(of("four-sensor", seeds, &other_models::four_sensor_made));
    rows.extend(of("fourier", seeds, &other_models::fourier_made));
    rows.extend(of(
        "step-diagonal",
        seeds,
        &other_models::step_diagonal_made,
    ));
    rows.extend(of("machine", seeds, &other_models::machine_made));
    rows
}

fn of<M: FittedModel + 'static>(
    model: &str,
    seeds: u64,
    make: &(impl Fn(Put<'_>, u64, f64) -> M + Sync),
) -> Vec<Row> {
    let Some(maker) = MAKERS.iter().find(|m| m.model == model) else {
        return Vec::new();
    };
    let mut rows = Vec::new();
    for (k, effect) in maker.effects.iter().enumerate() {
        // The zeros and turns of parts are drawn with the size as their standard deviation.
        if ["part-zero", "part-rotation", "part-temperature"].contains(effect) {
            continue;
        }
        let least = seen_from(maker, effect, &Options::default());
        let found: Vec<Option<[Tally; 2]>> = (0..seeds)
            .into_par_iter()
            .map(|seed| {
                let seed = 10_000 * (k as u64 + 1) + seed;
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                let size = least * 0.5 * 12f64.powf(random.random::<f64>());
                one(effect, size, seed, make)
            })
            .collect();
        let refused = found.iter().filter(|f| f.is_none()).count();
        let case = match refused {
            0 => format!("{model}, {effect}"),
            n => format!("{model}, {effect} ({n} refused or of another variant)"),
        };
        for (which, quantity) in ["size", "answer"].into_iter().enumerate() {
            let tallies = found.iter().flatten().map(|t| t[which]);
            let tally = tallies.fold(Tally::default(), Tally::and);
            if tally.any() {
                rows.push(Row {
                    case: case.clone(),
                    quantity: quantity.to_owned(),
                    seeds: seeds - refused as u64,
                    tally,
                });
            }
        }
    }
    rows
}

fn one<M: FittedModel + 'static>(
    effect: &str,
    size: f64,
    seed: u64,
    make: &impl Fn(Put<'_>, u64, f64) -> M,
) -> Option<[Tally; 2]> {
    let model = make(&[(effect, size)], seed, 1.0);
    let fit: Joined = joined(&model, model.effects(), &[effect.to_owned()], &options()).ok()?;
    let own = fit.effects.first()?;
    // The makers spoil sensor 3, probe 2 and the last of four sets.
    let right = |variant: &str| match variant.split_once(' ') {
        Some(("sensor", number)) => number == "3",
        Some(("probe", number)) => number == "2",
        Some(("set", number)) => number == "4",
        _ => true,
    };
    let parameters = if own.variant.as_deref().is_none_or(right) {
        &own.parameters
    } else {
        &own.elsewhere.iter().find(|e| right(&e.variant))?.parameters
    };
    let clean = make(&[], seed, 0.0);
    let readings = clean.linearised();
    let truth = size * told_of_put(model.name(), effect);
    let told = parameters.first()?;
    let freedom = fit.noise.degrees_of_freedom.unwrap_or(f64::INFINITY);
    let mut tallies = [Tally::default(); 2];
    if told.std.is_finite() {
        // Some makers turn the sign of what they are given.
        let error = (told.value - truth).abs().min((told.value + truth).abs());
        tallies[0].add(error, told.std, freedom);
    }
    // What is told from the circle through the readings has no truth of its own.
    if clean.name() == "circle" {
        return Some(tallies);
    }
    for (quantity, bias) in clean.quantities().iter().zip(&fit.quantities) {
        let truth = quantity.weights.dot(&readings);
        // The mean along an axis less the offset along it is zero by definition.
        if bias.after_std <= 1e-6 * bias.std {
            continue;
        }
        tallies[1].add(bias.after - truth, bias.after_std, freedom);
    }
    Some(tallies)
}
