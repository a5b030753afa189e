//! What is sealed before a measurement, against that measurement: `cargo run --release -p errsep-campaigns --bin
//! seal -- CASES SEED [EFFECT]`. Reversals by formulas of its own: one machine is measured, what a further
//! measurement will show is sealed, the same machine is set up anew and measured again, and the seal is scored.
//! Told is how often truth and findings lie in the sealed intervals, and how much of the readings in the
//! pointwise band.

#[path = "../tests/sealed_machine/mod.rs"]
mod sealed_machine;

use std::collections::BTreeMap;

use errsep::diagnosis::{Options, Standing, checked, sealed};
use errsep_models::model::FittedModel;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sealed_machine::{FAULTS, Fault, Layout, Machine};

/// Counts of one or many campaigns, by what was counted: inside and all.
type Counts = BTreeMap<String, [f64; 2]>;

fn one(fault: Fault, seed: u64) -> Counts {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let machine = Machine::drawn(fault, &mut random);
    let first = Layout {
        positions: 61,
        repeats: 4,
        both: true,
    };
    let grid = if seed.is_multiple_of(2) { 61 } else { 46 };
    let second = Layout {
        positions: grid,
        repeats: 3,
        both: true,
    };
    let options = Options::default();
    let now = machine.model(first, Some(&mut random));
    let plan = machine.model(second, None);
    let names: Vec<String> = fault.name().into_iter().map(str::to_owned).collect();
    let sealed = sealed(&now, &plan, now.effects(), &names, &options).unwrap();
    let next = machine.model(second, Some(&mut random));
    let score = checked(&next, next.effects(), &sealed, &options).unwrap();
    let mut counts = Counts::new();
    let mut count = |what: &str, inside: f64, all: f64| {
        let own = counts.entry(what.to_owned()).or_default();
        own[0] += inside;
        own[1] += all;
    };
    let yes = |inside: bool| f64::from(u8::from(inside));
    let readings = score.trace.readings as f64;
    count("band", score.trace.coverage * readings, readings);
    count(
        &format!("band, {grid} positions"),
        score.trace.coverage * readings,
        readings,
    );
    for number in score.effects.iter().flat_map(|e| &e.numbers) {
        count("sizes found", yes(number.inside), 1.0);
        if std::env::var_os("ERRSEP_CASES").is_some() {
            println!("{seed} {:?} {number:?}", fault.name());
        }
    }
    for number in &score.quantities {
        count("alpha found", yes(number.inside), 1.0);
    }
    if fault == Fault::Taper {
        let own = &sealed.effect[0].parameter[0];
        let truth = 1e-6 * machine.size;
        count(
            "sizes true",
            yes((own.ci95[0]..=own.ci95[1]).contains(&truth)),
            1.0,
        );
    }
    if let Some(own) = (fault == Fault::Drift).then(|| &sealed.effect[0].parameter) {
        // From the first planned reading to the last; the first is read at 2 s.
        let last = plan.places().iter().map(|p| p.time).fold(0.0, f64::max);
        let grown = (-2.0_f64 / 500.0).exp() * (1.0 - (-last / 500.0).exp());
        for (number, size) in own.iter().zip([0.6, 0.4]) {
            let truth = size * machine.size * grown;
            if std::env::var_os("ERRSEP_CASES").is_some() {
                println!("{seed} truth {truth} {number:?}");
            }
            count(
                "drift true",
                yes((number.ci95[0]..=number.ci95[1]).contains(&truth)),
                1.0,
            );
        }
    }
    if std::env::var_os("ERRSEP_CASES").is_some() {
        println!(
            "{seed} {:?} {:?} {:?} {:?}",
            sealed.effect.iter().map(|e| &e.variant).collect::<Vec<_>>(),
            score.quantities,
            score.without,
            score.with
        );
    }
    count("gap without", yes(score.without.inside), 1.0);
    count("gap with", yes(score.with.inside), 1.0);
    for effect in &score.effects {
        count(
            "cause stands",
            yes(effect.standing == Standing::Stands),
            1.0,
        );
    }
    counts
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, usual: u64| {
        let given = arguments.get(k).and_then(|a| a.parse().ok());
        given.unwrap_or(usual)
    };
    let (cases, seed) = (number(0, 20), number(1, 1));
    println!("{cases} campaigns a fault, seed {seed}");
    let chosen = arguments.get(2);
    let told = |fault: &Fault| chosen.is_none_or(|c| fault.name() == Some(c));
    for fault in FAULTS.into_iter().filter(told) {
        let all = (0..cases)
            .into_par_iter()
            .map(|k| one(fault, 1_000_000 * seed + k))
            .reduce(Counts::new, |mut sum, own| {
                for (what, [inside, all]) in own {
                    let entry = sum.entry(what).or_default();
                    entry[0] += inside;
                    entry[1] += all;
                }
                sum
            });
        println!("\n### {}\n", fault.name().unwrap_or("no fault"));
        for (what, [inside, of]) in all {
            println!("{what}: {:.1} % of {of}", 100.0 * inside / of);
        }
    }
}
