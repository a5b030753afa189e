//! Slope, eccentricity and inclination of a bar that turns while the slide feeds, in noise that is correlated
//! over several readings; and how often a steady turn is told to be unsteady.

use errsep::diagnosis::Kind;
use errsep::diagnosis::turning::{UNSTEADY_TURN, weigh};
use errsep_models::noise::Law;
use errsep_models::reversal::turning_bar::simulate::{TurningPlan, simulate};
use errsep_models::reversal::turning_bar::{Plan, Run, Setting, Survey, analyse};
use rayon::prelude::*;

use super::tally::{Row, Tally};

/// Levels of the false alarms.
const LEVELS: [f64; 2] = [0.01, 0.05];

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
    CASES.iter().flat_map(|case| of(case, seeds)).collect()
}

fn of((name, share, length, stray): &(&str, f64, f64, f64), seeds: u64) -> Vec<Row> {
    let found: Vec<Found> = (0..seeds)
        .into_par_iter()
        .filter_map(|seed| one(seed, *share, *length, *stray))
        .collect();
    let names = ["alpha_h + cone", "eccentricity", "inclination"];
    let row = |quantity: &str, tally: Tally| Row {
        case: (*name).to_owned(),
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
        .collect();
    for (k, level) in LEVELS.into_iter().enumerate() {
        let (mut quiet, mut named) = (Tally::default(), Tally::default());
        for f in &found {
            quiet.add_wide(!f.alarm[k]);
            named.add_wide(f.unsteady[k]);
        }
        let percent = 100.0 * level;
        rows.push(match *stray > 0.0 {
            true => row(&format!("named `{UNSTEADY_TURN}` at {percent} %"), named),
            false => row(&format!("no alarm at {percent} %"), quiet),
        });
    }
    rows
}

struct Found {
    tallies: [Tally; 3],
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
        },
        seed,
        ..TurningPlan::default()
    };
    let (all, _) = simulate(&made);
    let plan = Plan {
        setting: Setting {
            harmonics: vec![2],
            ..Setting::default()
        },
        form_cells: None,
        turn_cells: None,
    };
    let run = Run::new(&all).ok()?;
    let survey = Survey::new(&run, 0.0, plan.setting.handed, None).ok()?;
    let mut analysis = analyse(&run, &survey, &plan).ok()?;
    analysis.hold_out(&run, &survey);
    let told = LEVELS.map(|level| weigh(&run, &analysis, level, &[]));
    let chosen = told[0].chosen(&analysis);
    let spread = chosen.spread(&analysis);
    let bar = chosen.fit.bar(&spread)?;
    let truth = [
        made.slope_rad,
        made.eccentricity_um,
        made.gamma_rad[0].hypot(made.gamma_rad[1]),
    ];
    let values = [
        chosen.fit.slope(&spread),
        bar.eccentricity_um,
        bar.inclination_rad,
    ];
    let mut tallies = [Tally::default(); 3];
    for ((tally, value), truth) in tallies.iter_mut().zip(values).zip(truth) {
        tally.add(value.value - truth, value.std, f64::INFINITY);
    }
    Some(Found {
        tallies,
        alarm: [0, 1].map(|k| told[k].kind != Kind::None),
        unsteady: [0, 1].map(|k| told[k].effects.contains(&UNSTEADY_TURN)),
    })
}
