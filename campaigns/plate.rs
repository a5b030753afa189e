//! Plates with zero, turn, scales, squareness and a bend at once: `cargo run --release -p errsep-campaigns --bin
//! plate -- CASES SEED`. Prints how many are named exactly, how the sizes stand, what is said with
//! the bend withheld, and the alarms where nothing but the pose is there.

#[path = "../tests/plate/mod.rs"]
mod plate;

use errsep::diagnosis::{Diagnosis, Kind, Options, diagnose};
use plate::{Wrong, plate};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Standard deviation of a coordinate, µm.
const NOISE: f64 = 0.3;

fn main() {
    let mut arguments = std::env::args().skip(1).filter_map(|a| a.parse().ok());
    let (cases, seed): (u64, u64) = (
        arguments.next().unwrap_or(200),
        arguments.next().unwrap_or(1),
    );
    println!(
        "{cases} plates, seed {seed}; scales that differ by less than 1e-6 (four standard uncertainties) apart"
    );
    let outcomes: Vec<[String; 4]> = (0..cases)
        .into_par_iter()
        .map(|case| one(seed * 100_000 + case))
        .collect();
    for (k, what) in ["all three", "sizes", "bend withheld", "pose alone"]
        .iter()
        .enumerate()
    {
        let mut counts = std::collections::BTreeMap::new();
        for outcome in &outcomes {
            *counts.entry(&outcome[k]).or_insert(0) += 1;
        }
        println!("{what}: {counts:?}");
    }
}

fn one(seed: u64) -> [String; 4] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut signed = |least: f64, most: f64| {
        let size = least + (most - least) * random.random::<f64>();
        if random.random::<bool>() { size } else { -size }
    };
    let wrong = Wrong {
        scale_x: signed(3e-6, 1e-5),
        scale_y: signed(3e-6, 1e-5),
        squareness: signed(3e-6, 1e-5),
        sagitta: signed(1e-3, 3e-3),
    };
    let options = |without: &[&str]| Options {
        draws: 400,
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        ..Options::default()
    };
    let found = diagnose(&plate(wrong, NOISE, seed), &options(&[]));
    let withheld = diagnose(&plate(wrong, NOISE, seed), &options(&["straightness"]));
    let bare = diagnose(&plate(Wrong::default(), NOISE, seed), &options(&[]));
    let alike = (wrong.scale_x - wrong.scale_y).abs() < 1e-6;
    let scales = if alike { "scales alike: " } else { "" };
    [
        format!("{scales}{}", named(&found)),
        sizes(&found, wrong),
        named(&withheld),
        named(&bare),
    ]
}

fn named(diagnosis: &Diagnosis) -> String {
    let verdict = &diagnosis.verdict;
    let mut names = verdict.effects.clone();
    names.sort();
    match verdict.kind {
        Kind::None => "none".to_owned(),
        Kind::Unknown => "unknown".to_owned(),
        Kind::Effect if verdict.indistinguishable.is_empty() => names.join(" + "),
        Kind::Effect => format!(
            "{}, within {:?}",
            names.join(" + "),
            verdict.indistinguishable
        ),
    }
}

/// How many of squareness and scales are within two standard uncertainties.
fn sizes(diagnosis: &Diagnosis, wrong: Wrong) -> String {
    let near = |effect: &str, which: usize, truth: f64| {
        let candidate = diagnosis.candidates.iter().find(|c| c.effect == effect)?;
        let found = candidate.parameters.get(which)?;
        Some((found.value - truth).abs() <= 2.0 * found.std)
    };
    let all = [
        near("squareness-change", 0, wrong.squareness),
        near("scale-by-axis", 0, wrong.scale_x),
        near("scale-by-axis", 1, wrong.scale_y),
    ];
    let within = all.iter().flatten().filter(|near| **near).count();
    format!("{within} of {} within 2 u", all.iter().flatten().count())
}
