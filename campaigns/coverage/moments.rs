//! The moment at which something begins that lasts, and its size, of the cause that the diagnosis names alone: a zero that
//! jumps and a part that slips, at moments and in directions at random.

use errsep::diagnosis::{Diagnosis, Options, ParameterOut, diagnose};
use errsep_models::circle::{self, CirclePoints, CircleSimulation};
use errsep_models::reversal::Channel;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::tally::{Row, Tally};

/// Points of a pass, and passes, of a circle.
const CIRCLE: [usize; 2] = [72, 4];
/// Positions and repeats of a reversal.
const REVERSAL: (usize, u32) = (60, 4);
/// Readings before and after the moment, at least.
const FEWEST: usize = 10;

/// What a case is made of: the diagnosis, the effect that is in it, its moment and its sizes, µm.
type Made = (Diagnosis, &'static str, f64, Vec<f64>);

/// All rows; so many seeds each size.
pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    let slips = |um, seed| circle_made(um, seed, true);
    rows.extend(of(
        "circle, a part that slips",
        &[3.0, 5.0, 10.0, 20.0],
        seeds,
        slips,
    ));
    let jumps = |um, seed| circle_made(um, seed, false);
    rows.extend(of(
        "circle, a zero that jumps",
        &[2.0, 4.0, 8.0],
        seeds,
        jumps,
    ));
    let sizes = [1.5, 3.0, 6.0];
    rows.extend(of(
        "reversal, a channel's zero that jumps",
        &sizes,
        seeds,
        reversal_made,
    ));
    rows
}

fn options() -> Options {
    Options {
        draws: 400,
        ..Options::default()
    }
}

fn of(case: &str, sizes: &[f64], seeds: u64, make: impl Fn(f64, u64) -> Made + Sync) -> Vec<Row> {
    let mut rows = Vec::new();
    for um in sizes {
        let all: Vec<Option<[Tally; 2]>> = (0..seeds)
            .into_par_iter()
            .map(|seed| counted(&make(*um, seed)))
            .collect();
        let named: Vec<[Tally; 2]> = all.into_iter().flatten().collect();
        for (k, quantity) in ["moment", "sizes"].into_iter().enumerate() {
            rows.push(Row {
                case: format!(
                    "{case} by {um} um: named alone in {} of {seeds}",
                    named.len()
                ),
                quantity: quantity.to_owned(),
                seeds: named.len() as u64,
                tally: named
                    .iter()
                    .fold(Tally::default(), |sum, own| sum.and(own[k])),
            });
        }
    }
    rows
}

/// The moment and the sizes, where the effect is named alone, with its moment.
fn counted((found, effect, moment, sizes): &Made) -> Option<[Tally; 2]> {
    if found.verdict.effects != [*effect] {
        return None;
    }
    let freedom = found.noise.degrees_of_freedom.unwrap_or(f64::INFINITY);
    let own = found.candidates.iter().find(|c| c.effect == *effect)?;
    let named = |name: &str| own.parameters.iter().find(|p| p.name == name);
    let mut tallies = [Tally::default(), Tally::default()];
    let add = |tally: &mut Tally, told: &ParameterOut, truth: f64| {
        tally.add(told.value - truth, told.std, freedom);
    };
    add(&mut tallies[0], named("time")?, *moment);
    for (told, truth) in own.parameters.iter().zip(sizes) {
        add(&mut tallies[1], told, *truth);
    }
    Some(tallies)
}

/// Passes of points with 1 µm of noise, of which the later ones are moved: the centre in a direction at random, or the
/// zero of the probe.
fn circle_made(um: f64, seed: u64, slips: bool) -> Made {
    let [count, passes] = CIRCLE;
    let mut points = Vec::new();
    for pass in 0..passes {
        let what = CircleSimulation {
            count,
            noise_um: 1.0,
            pass: (pass, passes),
            ..CircleSimulation::default()
        };
        let own = circle::simulate_disturbed(&what, &[], 100_000 + 100 * seed + pass as u64);
        let own = own.expect("a circle of these measures can be simulated");
        points.extend(own.into_iter().map(|p| (p, pass as u32 + 1)));
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let first = random.random_range(FEWEST..points.len() - FEWEST);
    let along = random.random_range(0.0..std::f64::consts::TAU);
    let centre = points
        .iter()
        .fold([0.0; 2], |sum, (p, _)| [sum[0] + p.x, sum[1] + p.y]);
    let centre = centre.map(|sum| sum / points.len() as f64);
    for (point, _) in points.iter_mut().skip(first) {
        let outward = (point.y - centre[1]).atan2(point.x - centre[0]);
        let to = if slips { along } else { outward };
        point.x += 1e-3 * um * to.cos();
        point.y += 1e-3 * um * to.sin();
    }
    let model = CirclePoints::new(&points, None).expect("points about a circle");
    let found = diagnose(&model, &options());
    let moment = first as f64 - 0.5;
    if slips {
        return (
            found,
            "part-moved",
            moment,
            vec![um * along.cos(), um * along.sin()],
        );
    }
    (found, "zero-jump", moment, vec![um])
}

/// A reversal with 1 µm of noise, all later readings of one channel moved.
fn reversal_made(um: f64, seed: u64) -> Made {
    let noise = SceneNoise {
        white: 1.0,
        ..SceneNoise::default()
    };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scene = Scene::random(REVERSAL.0, REVERSAL.1, 1e-4, 5.0, noise, &mut random);
    let mut observations = scene.measured(1000 + seed);
    let channel = Channel::ALL[random.random_range(0..Channel::ALL.len())];
    let time = |k: usize| observations.readings[k].time.unwrap_or(f64::NAN);
    let all = 0..observations.readings.len();
    let mut own: Vec<usize> = all
        .filter(|k| observations.readings[*k].channel == channel)
        .collect();
    own.sort_by(|a, b| time(*a).total_cmp(&time(*b)));
    let first = random.random_range(FEWEST..own.len() - FEWEST);
    let moment = 0.5 * (time(own[first - 1]) + time(own[first]));
    for k in &own[first..] {
        observations.readings[*k].value += um;
    }
    let model = Linearised::new(&observations, Assumptions::default())
        .expect("readings of all four channels");
    (diagnose(&model, &options()), "zero-jump", moment, vec![um])
}
