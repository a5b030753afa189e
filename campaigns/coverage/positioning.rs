//! Figures of a positioning test: profiles with clear and without clear extremes, few and many runs, what
//! is known of the measurement, and data that are not as the uncertainties take them.
//!
//! Profiles, truths and readings are written here, not taken from the model's own simulation.

use errsep_models::positioning::{Direction, Figure, Influences, Reading, analyse};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{Row, Tally};

/// Standard deviation of a reading, µm.
const SIGMA: f64 = 1.0;
const LENGTH: f64 = 500.0;

/// Deviation forward and backward at a share of the travel, in units of [`SIGMA`].
type Shape = fn(f64) -> [f64; 2];

fn flat(_: f64) -> [f64; 2] {
    [0.0, 0.0]
}

fn slope(s: f64) -> [f64; 2] {
    [12.0 * s, 12.0 * s + 3.0]
}

fn wave(s: f64) -> [f64; 2] {
    let w = 3.0 * (7.3 * s).cos();
    [w - 1.0 - s, w + 1.0 + s]
}

fn slight(s: f64) -> [f64; 2] {
    let w = 0.6 * (5.1 * s).sin();
    [w, w + 0.3]
}

/// How readings depart from independent ones that scatter alike.
#[derive(Clone, Copy, PartialEq)]
enum Besides {
    Nothing,
    /// A drift that all runs have alike, and errors in proportion to length.
    Influences,
    /// Five times the scatter at every fourth target.
    Uneven,
    /// Each run is shifted.
    Shifts,
    /// Each run is stretched.
    Stretches,
    /// A steady drift with time.
    Drift,
}

struct Case {
    name: &'static str,
    shape: Shape,
    targets: usize,
    runs: u32,
    besides: Besides,
}

const fn case(
    name: &'static str,
    shape: Shape,
    targets: usize,
    runs: u32,
    besides: Besides,
) -> Case {
    Case {
        name,
        shape,
        targets,
        runs,
        besides,
    }
}

const CASES: [Case; 15] = [
    case("slope, 11 targets, 5 runs", slope, 11, 5, Besides::Nothing),
    case("wave, 11 targets, 5 runs", wave, 11, 5, Besides::Nothing),
    case(
        "slight wave, 11 targets, 5 runs",
        slight,
        11,
        5,
        Besides::Nothing,
    ),
    case("nothing, 11 targets, 5 runs", flat, 11, 5, Besides::Nothing),
    case("wave, 5 targets, 5 runs", wave, 5, 5, Besides::Nothing),
    case("wave, 41 targets, 5 runs", wave, 41, 5, Besides::Nothing),
    case("wave, 11 targets, 3 runs", wave, 11, 3, Besides::Nothing),
    case("wave, 11 targets, 2 runs", wave, 11, 2, Besides::Nothing),
    case("wave, 11 targets, 10 runs", wave, 11, 10, Besides::Nothing),
    case("slope, influences", slope, 11, 5, Besides::Influences),
    case("wave, influences", wave, 11, 5, Besides::Influences),
    case("wave, uneven scatter", wave, 11, 5, Besides::Uneven),
    case("wave, runs shifted by 1 µm", wave, 11, 5, Besides::Shifts),
    case(
        "wave, runs stretched by 2 µm",
        wave,
        11,
        5,
        Besides::Stretches,
    ),
    case(
        "wave, drift of 2 µm over the test, times told",
        wave,
        11,
        5,
        Besides::Drift,
    ),
];

const SHOWN: [Figure; 11] = [
    Figure::A,
    Figure::AForward,
    Figure::E,
    Figure::EForward,
    Figure::M,
    Figure::R,
    Figure::RForward,
    Figure::B,
    Figure::BMean,
    Figure::P,
    Figure::Ps,
];

const KNOWN: Influences = Influences {
    device: 2.0,
    misalignment: 0.8,
    expansion: 3.0,
    drift: 1.5,
};

pub fn rows(seeds: u64) -> Vec<Row> {
    CASES.iter().flat_map(|case| rows_of(case, seeds)).collect()
}

fn rows_of(case: &Case, seeds: u64) -> Vec<Row> {
    let found: Vec<[Option<bool>; SHOWN.len()]> = (0..seeds)
        .into_par_iter()
        .filter_map(|seed| one(case, seed))
        .collect();
    SHOWN
        .iter()
        .enumerate()
        .map(|(k, figure)| {
            let mut tally = Tally::default();
            for inside in found.iter().filter_map(|f| f[k]) {
                tally.add_wide(inside);
            }
            Row {
                case: case.name.to_owned(),
                quantity: figure.key().to_owned(),
                seeds: found.len() as u64,
                tally,
            }
        })
        .filter(|row| row.tally.any())
        .collect()
}

/// The true figures, from the mean deviations [forward, backward] and one standard deviation.
fn truth(profile: &[[f64; 2]], sigma: f64) -> [f64; SHOWN.len()] {
    let range = |values: Vec<f64>| {
        values.iter().copied().fold(f64::MIN, f64::max)
            - values.iter().copied().fold(f64::MAX, f64::min)
    };
    let e = range(profile.iter().flatten().copied().collect());
    let forward = range(profile.iter().map(|p| p[0]).collect());
    let m = range(profile.iter().map(|p| f64::midpoint(p[0], p[1])).collect());
    let reversals: Vec<f64> = profile.iter().map(|p| p[0] - p[1]).collect();
    let b = reversals.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let mean = reversals.iter().sum::<f64>() / reversals.len() as f64;
    // With one standard deviation everywhere, P is the range of means ± half the reversal and 6 σ.
    let ends = profile.iter().flat_map(|p| {
        let (mid, half) = (f64::midpoint(p[0], p[1]), 0.5 * (p[0] - p[1]).abs());
        [mid - half, mid + half]
    });
    let p = range(ends.collect()) + 6.0 * sigma;
    [
        e + 4.0 * sigma,
        forward + 4.0 * sigma,
        e,
        forward,
        m,
        b + 4.0 * sigma,
        4.0 * sigma,
        b,
        mean,
        p,
        6.0 * sigma,
    ]
}

/// Whether each interval holds its truth; none where no uncertainty is given.
fn one(case: &Case, seed: u64) -> Option<[Option<bool>; SHOWN.len()]> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let n = case.targets;
    let share = |i: usize| i as f64 / (n - 1) as f64;
    let profile: Vec<[f64; 2]> = (0..n)
        .map(|i| (case.shape)(share(i)).map(|v| v * SIGMA))
        .collect();
    let influences = match case.besides {
        Besides::Influences => KNOWN,
        _ => Influences::default(),
    };
    let of_length =
        (KNOWN.device.powi(2) + KNOWN.misalignment.powi(2) + KNOWN.expansion.powi(2)).sqrt() / 2.0;
    let stretch = normal() * of_length;
    let common: Vec<[f64; 2]> = (0..n)
        .map(|_| [normal(), normal()].map(|v| v * KNOWN.drift / 8.0_f64.sqrt()))
        .collect();
    let mut readings = Vec::new();
    let whole = f64::from(case.runs) * 2.0 * n as f64;
    for run in 1..=case.runs {
        let of_run = normal();
        for (d, direction) in [Direction::Forward, Direction::Backward]
            .into_iter()
            .enumerate()
        {
            for k in 0..n {
                let i = if d == 0 { k } else { n - 1 - k };
                let wide = if i % 4 == 3 && case.besides == Besides::Uneven {
                    5.0
                } else {
                    1.0
                };
                let more = match case.besides {
                    Besides::Nothing | Besides::Uneven => 0.0,
                    Besides::Influences => stretch * share(i) + common[i][d],
                    Besides::Shifts => of_run,
                    Besides::Stretches => 2.0 * of_run * share(i),
                    Besides::Drift => 2.0 * readings.len() as f64 / whole,
                };
                readings.push(Reading {
                    target: LENGTH * share(i),
                    run,
                    direction,
                    deviation: profile[i][d] + SIGMA * wide * normal() + more,
                    time: (case.besides == Besides::Drift).then_some(10.0 * readings.len() as f64),
                });
            }
        }
    }
    let found = analyse(&readings, &influences, seed).ok()?;
    let truth = truth(&profile, SIGMA);
    let mut inside = [None; SHOWN.len()];
    for (k, figure) in SHOWN.into_iter().enumerate() {
        let value = found.value(figure)?;
        if let Some(Ok(expanded)) = found.uncertainty(figure) {
            inside[k] = Some((value - truth[k]).abs() <= expanded);
        }
    }
    Some(inside)
}
