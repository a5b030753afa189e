//! Effects as unknowns of the simultaneous fit: tilts, forms and sizes, each effect by itself, and how far
//! the tilts lie from those of a fit of the same noise from which the effect was taken out beforehand.
//!
//! The readings are those of a machine with its own formulas, which share nothing with the fit.

#[path = "../../models/tests/faulty_machine/mod.rs"]
mod faulty_machine;

use errsep_models::reversal::simultaneous::{Knots, Options, Simultaneous, Thickness, With, fit};
use errsep_models::reversal::{Channel, Observations};
use faulty_machine::{Fault, Machine};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::tally::{Row, Tally};

const NOISE_UM: f64 = 0.05;
const CELLS: usize = 8;
const POSITIONS: usize = 61;
const REPEATS: u32 = 3;
/// Where the bands of the forms are looked at, as shares of the range.
const LOOKED_AT: [f64; 5] = [0.0, 0.11, 0.37, 0.63, 1.0];

/// A name of the catalogue, and the fault of a seed.
type Case = (&'static str, fn(&Machine, &mut ChaCha8Rng) -> Fault);

const CASES: &[Case] = &[
    ("taper", |_, r| Fault::Cone(signed(r, 1e-6, 10e-6))),
    ("gain-mismatch", |_, r| Fault::Gain(signed(r, 0.002, 0.02))),
    ("thermal-drift", |m, r| {
        let constant = m.duration() * (0.1 + 0.6 * r.random::<f64>());
        Fault::Drift(signed(r, 0.3, 1.0), signed(r, 0.3, 1.0), constant)
    }),
    ("ambient-cycle", |_, r| {
        let cycles = 1.5 + 10.0 * r.random::<f64>();
        Fault::Swing(
            signed(r, 0.08, 0.3).abs(),
            signed(r, 0.08, 0.3).abs(),
            cycles,
        )
    }),
    ("zero-jump", |_, r| {
        let share = 0.1 + 0.8 * r.random::<f64>();
        Fault::Jump(signed(r, 0.1, 0.4), r.random(), share)
    }),
    ("hysteresis", |_, r| Fault::Play(signed(r, 0.15, 0.5).abs())),
    ("reversal-shift", |_, r| Fault::Shift(signed(r, 1.5, 5.0))),
    ("indicator-nonlinearity", |_, r| {
        Fault::Curvature(signed(r, 0.01, 0.05), signed(r, 0.01, 0.05))
    }),
    ("axis-backlash", |_, r| {
        Fault::LostMotion(signed(r, 0.3, 1.5).abs())
    }),
    ("lateral-backlash", |_, r| {
        Fault::LateralPlay(signed(r, 0.03, 0.2))
    }),
    ("cyclic-error", |_, r| {
        let (period, phase) = (2.5 + 6.0 * r.random::<f64>(), 6.3 * r.random::<f64>());
        Fault::Cycle(signed(r, 0.08, 0.2).abs(), period, phase)
    }),
    ("local-contamination", |_, r| {
        let place = 30.0 + 240.0 * r.random::<f64>();
        let width = 6.0 + 8.0 * r.random::<f64>();
        let channel = Channel::ALL[r.random_range(0..4)];
        Fault::Bump(signed(r, 0.3, 0.8), place, width, channel, r.random())
    }),
    ("off-crest", |_, r| {
        // The product of both obliquities is what shows: 0.1 to 0.5 µm at the ends of the travel.
        let (radius, slide) = (
            10.0 + 30.0 * r.random::<f64>(),
            0.05 + 0.2 * r.random::<f64>(),
        );
        Fault::Askew(radius, slide, 1e-3 * signed(r, 0.1, 0.5) * radius / slide)
    }),
    ("thickness-shift", |_, r| {
        Fault::Thicker(signed(r, 10.0, 40.0).abs())
    }),
];

/// A size of either sign between two, log-uniform.
fn signed(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    let size = low * (high / low).powf(random.random::<f64>());
    if random.random() { size } else { -size }
}

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut pooled: Vec<Row> = Vec::new();
    let mut rows: Vec<Row> = Vec::new();
    for (k, case) in CASES.iter().enumerate() {
        // Every effect has machines and noise of its own, so that rows may be pooled.
        let first = 100_000 * k as u64;
        let found: Vec<Option<Vec<(&'static str, Tally)>>> = (first..first + seeds)
            .into_par_iter()
            .map(|seed| one(case, seed))
            .collect();
        let failed = found.iter().filter(|f| f.is_none()).count();
        let name = match failed {
            0 => case.0.to_owned(),
            n => format!("{} ({n} without an answer)", case.0),
        };
        for (quantity, tally) in found.iter().flatten().flatten() {
            add(&mut rows, &name, quantity, *tally);
            add(&mut pooled, "all effects", quantity, *tally);
        }
    }
    rows.extend(pooled);
    rows
}

fn add(rows: &mut Vec<Row>, case: &str, quantity: &str, tally: Tally) {
    match rows
        .iter_mut()
        .find(|r| r.case == case && r.quantity == quantity)
    {
        Some(row) => {
            row.tally = row.tally.and(tally);
            row.seeds += 1;
        }
        None => rows.push(Row {
            case: case.to_owned(),
            quantity: quantity.to_owned(),
            seeds: 1,
            tally,
        }),
    }
}

fn solved(observations: &Observations, effects: &[&str], cells: usize) -> Option<Simultaneous> {
    let options = Options {
        thickness: Thickness::Known(42.0),
        knots: Knots::Cells(cells),
        effects: effects.iter().map(|e| With::named(*e)).collect(),
        ..Options::default()
    };
    fit(observations, &options).ok()
}

fn one((effect, fault): &Case, seed: u64) -> Option<Vec<(&'static str, Tally)>> {
    let mut machine = Machine::random(seed, CELLS, POSITIONS, REPEATS, NOISE_UM);
    let mut cells = CELLS;
    if *effect == "thickness-shift" {
        // Small tilts leave no trace of it. Large ones move the artefact's knots off those of the truth by
        // the unknown thickness times the tilt: finer ones follow.
        machine.tilts[2] = 30e-3;
        cells *= 3;
    }
    let fault = fault(&machine, &mut ChaCha8Rng::seed_from_u64(seed ^ 0xfa17));
    let observations = machine.measured(&[fault], seed);
    let with = solved(&observations, &[effect], cells)?;
    let without = solved(&machine.measured(&[], seed), &[], cells)?;
    let (mut tilts, mut apart) = (Tally::default(), Tally::default());
    for ((tilt, clean), truth) in with.tilts().iter().zip(without.tilts()).zip(machine.tilts) {
        tilts.add(
            tilt.angle.value - truth,
            tilt.angle.std,
            tilt.degrees_of_freedom,
        );
        let added = tilt.angle.std.powi(2) - clean.angle.std.powi(2);
        // An effect that leaves a tilt alone adds nothing that could be told from rounding of the noise.
        if added > 0.2 * clean.angle.std.powi(2) {
            apart.add(
                tilt.angle.value - clean.angle.value,
                added.sqrt(),
                tilt.degrees_of_freedom,
            );
        }
    }
    let x: Vec<f64> = LOOKED_AT.iter().map(|share| share * 300.0).collect();
    let mut forms = Tally::default();
    for (profile, form) in with.forms(&x).iter().zip(&machine.forms) {
        for ((x, value), std) in x.iter().zip(&profile.values).zip(&profile.std) {
            forms.add(value - form.at(*x), *std, profile.degrees_of_freedom);
        }
    }
    let mut sizes = Tally::default();
    let mut moment = Tally::default();
    for (name, truth) in truths(fault, &machine, &observations) {
        let all = with.effects.iter().flat_map(|e| &e.parameters);
        let Some(own) = all.into_iter().find(|p| p.name == name) else {
            continue;
        };
        // At its bound nothing is claimed.
        let Some(std) = own.std else { continue };
        let tally = if name == "time" {
            &mut moment
        } else {
            &mut sizes
        };
        tally.add(own.value - truth, std, own.degrees_of_freedom);
    }
    let mut found = vec![
        ("tilts", tilts),
        ("forms", forms),
        ("sizes and shapes", sizes),
    ];
    if moment.any() {
        found.push(("time of the jump", moment));
    }
    if apart.any() {
        found.push((
            "tilts less those without the effect, against what it adds",
            apart,
        ));
    }
    Some(found)
}

/// What is told of a fault, by name.
fn truths(
    fault: Fault,
    machine: &Machine,
    observations: &Observations,
) -> Vec<(&'static str, f64)> {
    match fault {
        Fault::Cone(cone) => vec![("half-angle", cone)],
        Fault::Gain(gain) => vec![("mismatch", gain)],
        Fault::Drift(near, far, constant) => vec![
            ("near-drift", near),
            ("far-drift", far),
            ("time-constant", constant),
        ],
        Fault::Swing(near, far, cycles) => vec![
            ("near-amplitude", near),
            ("far-amplitude", far),
            ("period", machine.duration() / cycles),
        ],
        Fault::Jump(size, _, share) => vec![("jump", size), ("time", share * machine.duration())],
        Fault::Play(width) => vec![("width", width)],
        Fault::Curvature(near, far) => {
            let values = observations.readings.iter().map(|r| r.value.abs());
            let reach = values.fold(0.0, f64::max);
            let at = |c: f64| c * (reach / 10.0).powi(2);
            vec![("near-deviation", at(near)), ("far-deviation", at(far))]
        }
        Fault::LostMotion(lost) => vec![("backlash", lost)],
        Fault::LateralPlay(play) => vec![("backlash", play)],
        Fault::Cycle(size, period, _) => vec![("amplitude", size), ("period", period)],
        Fault::Bump(height, place, width, _, _) => {
            vec![("height", height), ("position", place), ("width", width)]
        }
        Fault::Shift(shift) => vec![("shift", shift)],
        Fault::Thicker(more) => vec![("thickness", more)],
        Fault::Askew(radius, slide, bar) => {
            vec![
                ("loss", 1e3 * slide * bar / radius),
                ("loss-along-line", 0.0),
            ]
        }
    }
}
