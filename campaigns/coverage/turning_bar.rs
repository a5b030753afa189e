//! Slope, eccentricity and inclination of a bar that turns while the slide feeds, its form and the lag of its
//! turn at several places, in noise that is correlated over several readings; and how often a steady turn is
//! told to be unsteady.

use errsep::diagnosis::Kind;
use errsep::diagnosis::turning::{UNSTEADY_TURN, weigh};
use errsep_models::noise::Law;
use errsep_models::reversal::turning_bar::simulate::{TurningPlan, TurningTruth, simulate};
use errsep_models::reversal::turning_bar::{Plan, Run, Setting, Survey, TurningReading, analyse};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{Row, Tally};

/// Levels of the false alarms.
const LEVELS: [f64; 2] = [0.01, 0.05];

/// Where form and lag are compared with the truth: shares of travel and time.
const PLACES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// The part of the noise that is correlated, over how many readings, and by how much the turn strays, rad.
const CASES: [(&str, f64, f64, f64); 4] = [
    ("unsteady turn, white noise", 0.0, 1.0, 2.0),
    (
        "unsteady turn, noise correlated over 2 readings",
        0.8,
        2.0,
        2.0,
    ),
    (
        "steady turn, noise correlated over 2 readings",
        0.8,
        2.0,
        0.0,
    ),
    (
        "steady turn, noise correlated over 6 readings",
        0.8,
        6.0,
        0.0,
    ),
];

/// The table.
pub fn rows(seeds: u64) -> Vec<Row> {
    let own = CASES.iter().flat_map(|(name, share, length, stray)| {
        let one = |seed| one(seed, *share, *length, *stray);
        of(name, *stray > 0.0, one, seeds)
    });
    let mean = of(
        "steady turn of 30 turns with 40 readings, noise a running mean over 5 readings",
        false,
        |seed| judged(running_mean(seed)),
        seeds,
    );
    let other = of(
        "another maker: loaded drive, uneven feed, steps of 0.02 um, noise correlated over 4 readings",
        true,
        |seed| judged(another(seed)),
        seeds,
    );
    own.chain(mean).chain(other).collect()
}

fn of(
    name: &str,
    unsteady: bool,
    one: impl Fn(u64) -> Option<Found> + Sync + Send,
    seeds: u64,
) -> Vec<Row> {
    let found: Vec<Found> = (0..seeds).into_par_iter().filter_map(one).collect();
    let names = [
        "alpha_h + cone",
        "eccentricity",
        "inclination",
        "form at five places",
        "lag at five times",
    ];
    let row = |quantity: &str, tally: Tally| Row {
        case: name.to_owned(),
        quantity: quantity.to_owned(),
        seeds: found.len() as u64,
        tally,
    };
    let together = |k: usize| {
        found
            .iter()
            .fold(Tally::default(), |sum, f| sum.and(f.tallies[k]))
    };
    let mut rows: Vec<Row> = names
        .iter()
        .enumerate()
        .map(|(k, n)| row(n, together(k)))
        .filter(|row| row.tally.any())
        .collect();
    for (k, level) in LEVELS.into_iter().enumerate() {
        let (mut quiet, mut named) = (Tally::default(), Tally::default());
        for f in &found {
            quiet.add_wide(!f.alarm[k]);
            named.add_wide(f.unsteady[k]);
        }
        let percent = 100.0 * level;
        rows.push(match unsteady {
            true => row(&format!("named `{UNSTEADY_TURN}` at {percent} %"), named),
            false => row(&format!("no alarm at {percent} %"), quiet),
        });
    }
    rows
}

struct Found {
    tallies: [Tally; 5],
    /// Whether anything is told, and whether that is an unsteady turn, by level.
    alarm: [bool; 2],
    unsteady: [bool; 2],
}

/// One run of 24 turns of 60 readings, form and turn with 6 cells.
fn one(seed: u64, share: f64, readings: f64, stray: f64) -> Option<Found> {
    let made = TurningPlan {
        readings: 1440,
        turns: 24.0,
        stray_rad: stray,
        noise: Law {
            white: 0.05 * (1.0 - share),
            correlated: 0.05 * share,
            // 24 turns at 3 a minute: a third of a second from reading to reading.
            length: readings / 3.0,
            shift: 0.0,
            drift: 0.0,
        },
        seed,
        ..TurningPlan::default()
    };
    let (all, truth) = simulate(&made);
    judged(Made::of(&made, all, truth))
}

/// Turns that are steady, in noise that no law of the fit has: a running mean.
fn running_mean(seed: u64) -> Made {
    let made = TurningPlan {
        readings: 1200,
        turns: 30.0,
        noise: Law::of_white(0.0),
        seed,
        ..TurningPlan::default()
    };
    let (mut all, truth) = simulate(&made);
    let mut random = ChaCha8Rng::seed_from_u64(0x0e4d_0000 + seed);
    let white: Vec<f64> = (0..all.len() + 4)
        .map(|_| StandardNormal.sample(&mut random))
        .collect();
    for (reading, window) in all.iter_mut().zip(white.windows(5)) {
        reading.value += 0.1 * window.iter().sum::<f64>();
    }
    Made::of(&made, all, truth)
}

/// A run with what is true of it: α + τ (rad), |e| at mid travel (µm), |γ| (rad); at each reading the form
/// without its line (µm) and by how much the spindle is behind a steady turn (rad).
struct Made {
    readings: Vec<TurningReading>,
    slope: f64,
    eccentricity: f64,
    inclination: f64,
    form: Vec<f64>,
    lag: Vec<f64>,
}

impl Made {
    fn of(plan: &TurningPlan, readings: Vec<TurningReading>, truth: TurningTruth) -> Self {
        Self {
            readings,
            slope: plan.slope_rad,
            eccentricity: plan.eccentricity_um,
            inclination: plan.gamma_rad[0].hypot(plan.gamma_rad[1]),
            form: truth.form_um,
            lag: truth.lag_rad,
        }
    }
}

/// A run by other physics than the simulator's. The spindle follows a drive that is loaded anew every few
/// turns, with a time constant; the feed is uneven; the bar is a line in space that is turned about the axis
/// of the spindle; the form is bumps and a bow; the indicator shows steps; its noise is a running mean over
/// four readings beside a white part, neither of which the laws of the fit have.
fn another(seed: u64) -> Made {
    let mut random = ChaCha8Rng::seed_from_u64(0x5eed_0000 + seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let (n, step) = (1440, 1.0 / 3.0);
    let (mut theta, mut turning, mut wanted, mut x) = (6.0 * normal(), 0.314, 0.314, 0.0);
    let (slope, eccentricity) = (4e-5 * normal(), 9.0 + normal().abs() * 4.0);
    let (inclination, twist) = (7e-5, 3.0 * normal());
    let bumps: Vec<[f64; 3]> = (0..7)
        .map(|k| {
            [
                normal(),
                36.0 * (f64::from(k) + 0.5 * normal()),
                14.0 + 3.0 * normal().abs(),
            ]
        })
        .collect();
    let white: Vec<f64> = (0..n + 3).map(|_| normal()).collect();
    let apart: Vec<f64> = (0..n).map(|_| normal()).collect();
    let loads: Vec<f64> = (0..n / 150 + 1).map(|_| normal()).collect();
    let mut places = Vec::with_capacity(n);
    for i in 0..n {
        places.push((step * i as f64, x, theta));
        if i % 150 == 0 {
            wanted = 0.314 * (1.0 + 0.01 * loads[i / 150]);
        }
        turning += (wanted - turning) * step / 9.0;
        theta += turning * step;
        x += 0.17 * (1.0 + 0.1 * (i as f64 / 70.0).sin());
    }
    let half = 0.5 * x;
    let bump = |x: f64| -> f64 {
        let bow = 3.0 * ((x - half) / half).powi(2);
        bow + bumps
            .iter()
            .map(|[h, c, w]| h * (-0.5 * ((x - c) / w).powi(2)).exp())
            .sum::<f64>()
    };
    let form: Vec<f64> = places.iter().map(|p| bump(p.1)).collect();
    // The line of the form belongs to the slope: that over the places along x, each of which counts by the
    // travel that it stands for, not by the readings that an uneven feed takes there.
    let place = |i: usize| places[i.min(n - 1)].1;
    let travel = |i: usize| 0.5 * (place(i + 1) - place(i.max(1) - 1));
    let mean = |values: &dyn Fn(usize) -> f64| {
        let sum = (0..n).map(|i| travel(i) * values(i)).sum::<f64>();
        sum / (0..n).map(travel).sum::<f64>()
    };
    let (mx, mf) = (mean(&place), mean(&|i| form[i]));
    let line = mean(&|i| (place(i) - mx) * (form[i] - mf)) / mean(&|i| (place(i) - mx).powi(2));
    let bent = (0..n).map(|i| form[i] - mf - line * (place(i) - mx));
    // A steady turn is the least-squares line of the angles over the times.
    let even = |f: &dyn Fn(usize) -> f64| (0..n).map(f).sum::<f64>() / n as f64;
    let (mt, ma) = (even(&|i| places[i].0), even(&|i| places[i].2));
    let since = |i: usize| places[i].0 - mt;
    let speed = even(&|i| since(i) * places[i].2) / even(&|i| since(i).powi(2));
    let lag = (0..n).map(|i| ma + speed * since(i) - places[i].2);
    let middle = f64::midpoint(places[0].1, places[n - 1].1);
    let readings = (0..n)
        .map(|i| {
            let (time, x, theta) = places[i];
            // Two points of the axis, turned about that of the spindle.
            let along = [eccentricity, 0.0];
            let tilt = [
                1e3 * inclination * twist.cos(),
                1e3 * inclination * twist.sin(),
            ];
            let own = [0, 1].map(|k| along[k] + tilt[k] * (x - middle));
            let turned = own[0] * theta.cos() - own[1] * theta.sin();
            let section = 0.25 * (2.0 * theta + 1.0).cos();
            let noise = 0.05 * white[i..i + 4].iter().sum::<f64>() / 4.0 + 0.02 * apart[i];
            let value = turned + section + form[i] + 1e3 * slope * x + noise;
            TurningReading {
                time: Some(time),
                x,
                value: (value / 0.02).round() * 0.02,
                spindle: None,
            }
        })
        .collect();
    Made {
        readings,
        slope: slope + 1e-3 * line,
        eccentricity,
        inclination,
        form: bent.collect(),
        lag: lag.collect(),
    }
}

/// What is found in a run.
fn judged(made: Made) -> Option<Found> {
    let all = &made.readings;
    let plan = Plan {
        setting: Setting {
            harmonics: vec![2],
            ..Setting::default()
        },
        form_cells: None,
        turn_cells: None,
    };
    let run = Run::new(all).ok()?;
    let survey = Survey::new(&run, 0.0, plan.setting.handed, None).ok()?;
    let mut analysis = analyse(&run, &survey, &plan).ok()?;
    analysis.hold_out(&run, &survey);
    let told = LEVELS.map(|level| weigh(&run, &analysis, level, &[]));
    let chosen = told[0].chosen(&analysis);
    let spread = chosen.spread(&analysis);
    let bar = chosen.fit.bar(&spread)?;
    let truth = [made.slope, made.eccentricity, made.inclination];
    let values = [
        chosen.fit.slope(&spread),
        bar.eccentricity_um,
        bar.inclination_rad,
    ];
    let mut tallies = [Tally::default(); 5];
    let freedom = chosen.turns.freedom.max(1.0);
    for ((tally, value), truth) in tallies.iter_mut().zip(values).zip(truth) {
        tally.add(value.value - truth, value.std, freedom);
    }
    let at = |share: f64| (share * (all.len() - 1) as f64).round() as usize;
    let places = PLACES.map(|share| all[at(share)].x);
    let form = chosen.fit.form(&places, &spread);
    for (value, share) in form.iter().zip(PLACES) {
        tallies[3].add(value.value - made.form[at(share)], value.std, freedom);
    }
    // One point of the curve a reading.
    if let Some(curve) = chosen.fit.curve(all.len(), survey.base_hz, &spread) {
        for i in PLACES.map(at) {
            tallies[4].add(curve.lag_rad[i] - made.lag[i], curve.lag_std[i], freedom);
        }
    }
    Some(Found {
        tallies,
        alarm: [0, 1].map(|k| told[k].kind != Kind::None),
        unsteady: [0, 1].map(|k| told[k].effects.contains(&UNSTEADY_TURN)),
    })
}
